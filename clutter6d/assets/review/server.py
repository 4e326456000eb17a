"""The review page's server: this machine only, and nothing without the secret path."""

import logging
import secrets
import sys
from http.server import ThreadingHTTPServer
from typing import Any

from clutter6d.assets.review.handler import ReviewHandler
from clutter6d.assets.review.session import ReviewSession
from clutter6d.errors import InvalidValueError

ADDRESS = "127.0.0.1"

_log = logging.getLogger(__name__)


class ReviewServer(ThreadingHTTPServer):
    """Serves the review of one library; stop it with ``shutdown``.

    Args:
        session: Whose decisions it takes.
        port: 0 for any free one.

    Raises:
        InvalidValueError: The port is taken, or not ours to take.
    """

    daemon_threads = True

    def __init__(self, session: ReviewSession, port: int = 0) -> None:
        self.session = session
        self.token = secrets.token_urlsafe(24)
        try:
            super().__init__((ADDRESS, port), ReviewHandler)
        except OSError as error:
            raise InvalidValueError(f"--port {port}: {error.strerror}; choose another, or 0 for any free one") from None

    @property
    def host(self) -> str:
        """Address and port, as the page's requests must name them."""
        return f"{ADDRESS}:{self.server_port}"

    @property
    def url(self) -> str:
        """Where the page is; whoever knows it may decide."""
        return f"http://{self.host}/{self.token}/"

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ARG002
        """A connection that broke is no news; anything else is, in one line."""
        error = sys.exc_info()[1]
        level = logging.DEBUG if isinstance(error, ConnectionError | TimeoutError) else logging.ERROR
        _log.log(level, "review page: %s: %s", type(error).__name__, error)
