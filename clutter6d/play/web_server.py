"""The web server of a live view: viser's, kept to this machine and to what a viewer needs.

viser serves one page that holds everything it needs, and takes messages from whoever opens a web socket. Left as it is,
it would let any page in the same browser in, take uploads, and open a tunnel to a public server when a client asks for
it; none of that is possible here.
"""

import contextlib
import io
import logging
import socket
from collections.abc import Generator
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from clutter6d.errors import InvalidValueError, MissingDependencyError

if TYPE_CHECKING:
    import viser

THIS_MACHINE = ("127.0.0.1", "::1", "localhost")
_UNWANTED = ("FileTransferStartUpload", "FileTransferPart", "ShareUrlRequest", "ShareUrlDisconnect")
_POLICY_VIOLATION = 1008


def open_server(host: str = "127.0.0.1", port: int = 0) -> "viser.ViserServer":
    """Start a server; stop it by :func:`close_server`.

    Args:
        host: Address to listen at.
        port: 0 for any free one.

    Raises:
        MissingDependencyError: viser is not installed.
        InvalidValueError: The address is not this machine's, or the port is taken or not ours to take.
    """
    try:
        import viser
    except ImportError:
        raise MissingDependencyError('the web viewer needs viser; run: pip install "clutter6d[play]"') from None
    _check_address(host, port)
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)  # what a client sends wrong is no news
    with _quiet():
        server = viser.ViserServer(host=host, port=port, verbose=False)
    _refuse_unwanted_messages(server)
    _refuse_other_pages(server, host)
    return server


def close_server(server: "viser.ViserServer") -> None:
    """Disconnect everyone and stop listening; more than once is no error."""
    with _quiet(), contextlib.suppress(RuntimeError):
        server.stop()
        server._thread_executor.shutdown()


def _check_address(host: str, port: int) -> None:
    """Find out before viser does whether an address can be had: it would try other ports, for ever."""
    try:
        with socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET):
            pass
    except (OSError, OverflowError, UnicodeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InvalidValueError(
            f"--host {host} --port {port}: {why}; choose others, or port 0 for any free one"
        ) from None


def _refuse_unwanted_messages(server: "viser.ViserServer") -> None:
    """No uploads, and no public address."""
    from viser import _messages as messages

    for name in _UNWANTED:
        server._websock_server.unregister_handler(getattr(messages, name))


def _refuse_other_pages(server: "viser.ViserServer", host: str) -> None:
    """Turn away a web socket that a page from elsewhere opens; browsers do not stop that themselves."""

    async def check(connection: Any) -> None:
        web_socket = server._websock_server._live_connections[connection.client_id]
        origin = web_socket.request.headers.get("Origin") if web_socket.request else None
        if not is_own_page(origin, host, server.get_port()):
            await web_socket.close(_POLICY_VIOLATION, "this page is not the viewer's")

    server._websock_server.on_client_connect(check)


def is_own_page(origin: str | None, host: str, port: int) -> bool:
    """Whether a web socket's origin is the viewer's own page; programs that are no browser name none.

    Args:
        origin: The header ``Origin``.
        host: Address that the server listens at.
        port: Its port.
    """
    if origin is None or host not in THIS_MACHINE:
        return True
    try:
        parts = urlsplit(origin)
        return parts.scheme == "http" and parts.hostname in THIS_MACHINE and parts.port == port
    except ValueError:
        return False


@contextlib.contextmanager
def _quiet() -> Generator[None]:
    """Keep to oneself what viser prints."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield
