"""How the review page's requests are answered, and which are not.

Other pages in the same browser can send requests to 127.0.0.1, under any host name if they rebind DNS. They do not know
the token that every path starts with; besides, the Host header must name this server, and whatever changes something
must be JSON from this origin.
"""

import json
import logging
import re
import secrets
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from typing import Any, Protocol, TypeVar

from pydantic import Field, ValidationError

from clutter6d.assets.attribute_change import AttributeChange
from clutter6d.assets.review.entry import MAX_REASON_LENGTH, ReviewEntry, Verdict
from clutter6d.assets.review.page_files import HEADERS, PAGE_FILES, page_file
from clutter6d.assets.review.payload import asset_payload, decision_payload, geometry_block, overview_payload
from clutter6d.assets.review.session import ReviewConflictError, ReviewSession, UnknownVersionError
from clutter6d.errors import Clutter6DError, MissingFileError, UserError
from clutter6d.schema import FileModel

MAX_BODY_BYTES = 64 << 10
IDLE_SECONDS = 60

_log = logging.getLogger(__name__)
_ASSET_PATH = re.compile(r"api/assets/([0-9a-f]{64})(/geometry)?")


class _ChangeBody(FileModel):
    category: str | None = None
    colour: str | None = None
    material: str | None = None
    mass_kg: float | None = None
    friction: float | None = None


class DecisionBody(FileModel):
    """What the page posts to ``api/decisions``."""

    asset_hash: str = Field(pattern=r"^[0-9a-f]{64}$")
    decision: Verdict
    change: _ChangeBody | None = None
    reason: str = Field(default="", max_length=MAX_REASON_LENGTH)


class UndoBody(FileModel):
    """What the page posts to ``api/undo``."""

    entry_id: str


Body = TypeVar("Body", bound=FileModel)


class RefusedRequestError(Exception):
    """A request that is answered with a status and one line."""

    def __init__(self, status: HTTPStatus, problem: str) -> None:
        super().__init__(problem)
        self.status = status


class ServesReview(Protocol):
    """What a handler needs of its server."""

    session: ReviewSession
    token: str

    @property
    def host(self) -> str:
        """Address and port, as the page's requests must name them."""
        ...


class ReviewHandler(BaseHTTPRequestHandler):
    """Answers one connection."""

    server: ServesReview  # pyright: ignore[reportIncompatibleVariableOverride]
    protocol_version = "HTTP/1.1"
    server_version = "clutter6d"
    sys_version = ""
    timeout = IDLE_SECONDS

    def do_GET(self) -> None:
        """Files of the page, and what is known of assets."""
        self._answer(self._get)

    def do_POST(self) -> None:
        """Decisions."""
        self._answer(self._post)

    def _answer(self, action: Callable[[str], None]) -> None:
        try:
            action(self._checked_path())
        except ConnectionError:
            self.close_connection = True
        except RefusedRequestError as error:
            self._send_problem(error.status, str(error))
        except (UnknownVersionError, MissingFileError) as error:
            self._send_problem(HTTPStatus.NOT_FOUND, str(error))
        except ReviewConflictError as error:
            self._send_problem(HTTPStatus.CONFLICT, str(error))
        except UserError as error:
            self._send_problem(HTTPStatus.BAD_REQUEST, str(error))
        except (Clutter6DError, OSError) as error:
            _log.warning("%s", error)
            self._send_problem(HTTPStatus.INTERNAL_SERVER_ERROR, str(error))

    def _get(self, path: str) -> None:
        if path in PAGE_FILES:
            name, kind = PAGE_FILES[path]
            return self._send(HTTPStatus.OK, page_file(name), kind)
        if path == "api/assets":
            return self._send_json(overview_payload(self.server.session))
        named = _ASSET_PATH.fullmatch(path)
        if named is None:
            raise RefusedRequestError(HTTPStatus.NOT_FOUND, "there is no such page")
        asset = self.server.session.load(named[1])
        if named[2]:
            return self._send(HTTPStatus.OK, geometry_block(asset), "application/octet-stream")
        return self._send_json(asset_payload(asset))

    def _post(self, path: str) -> None:
        actions: Mapping[str, Callable[[], ReviewEntry]] = {"api/decisions": self._decide, "api/undo": self._undo}
        if path not in actions:
            raise RefusedRequestError(HTTPStatus.NOT_FOUND, "there is no such page to post to")
        entry = actions[path]()
        self._send_json(decision_payload(self.server.session, entry))

    def _decide(self) -> ReviewEntry:
        body = self._read_body(DecisionBody)
        change = AttributeChange(**body.change.model_dump()) if body.change else None
        return self.server.session.decide(body.asset_hash, body.decision, change=change, reason=body.reason)

    def _undo(self) -> ReviewEntry:
        return self.server.session.undo(self._read_body(UndoBody).entry_id)

    def _checked_path(self) -> str:
        """The path below the token of a request that this server's own page may have sent."""
        if self.headers.get_all("Host") != [self.server.host]:
            raise RefusedRequestError(HTTPStatus.FORBIDDEN, f"this is {self.server.host} and nothing else")
        if self.headers.get("Origin", f"http://{self.server.host}") != f"http://{self.server.host}":
            raise RefusedRequestError(HTTPStatus.FORBIDDEN, "requests of other pages are not answered")
        start = f"/{self.server.token}/"
        if not secrets.compare_digest(self.path[: len(start)].encode(), start.encode()):
            raise RefusedRequestError(HTTPStatus.FORBIDDEN, "open the address that the command printed")
        return self.path[len(start) :]

    def _read_body(self, model: type[Body]) -> Body:
        if self.headers.get_content_type() != "application/json":
            raise RefusedRequestError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "send application/json")
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()) or self.headers.get("Transfer-Encoding"):
            raise RefusedRequestError(HTTPStatus.LENGTH_REQUIRED, "say the length of the body")
        if len(length) > 9 or int(length) > MAX_BODY_BYTES:
            raise RefusedRequestError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"at most {MAX_BODY_BYTES:,} bytes")
        try:
            return model.model_validate_json(self.rfile.read(int(length)))
        except ValidationError as error:
            first = error.errors(include_url=False, include_input=False)[0]
            field = ".".join(map(str, first["loc"])) or "body"
            raise RefusedRequestError(HTTPStatus.BAD_REQUEST, f"{field}: {first['msg']}") from None

    def _send_json(self, value: Mapping[str, Any]) -> None:
        self._send(HTTPStatus.OK, json.dumps(value, allow_nan=False).encode(), "application/json")

    def _send_problem(self, status: int, problem: str) -> None:
        """One line of JSON; the connection ends, since a body may be left unread."""
        self.close_connection = True
        self._send(status, json.dumps({"error": " ".join(problem.split())}).encode(), "application/json")

    def _send(self, status: int, content: bytes, kind: str) -> None:
        self.send_response(status)
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """What the standard library refuses is refused like everything else."""
        self._send_problem(code, message or explain or HTTPStatus(code).phrase)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 (named by the standard library)
        """Requests are logged for debugging, without the secret path."""
        _log.debug("%s", (format % args).replace(self.server.token, "…"))
