"""The viewer's server keeps to this machine, and to what a viewer needs."""

import asyncio
import logging
import socket
import threading

import msgspec
import pytest
from viser import _messages as messages
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from clutter6d.errors import InvalidValueError
from clutter6d.play.web_server import close_server, is_own_page, open_server

PROTOCOL = "viser-v1.1.1"


@pytest.fixture(scope="module")
def server():
    server = open_server()
    yield server
    close_server(server)


def talk(port: int, origin: str | None, *sent: bytes) -> list[bytes]:
    """What comes within half a second of opening a web socket and sending something."""

    async def run() -> list[bytes]:
        received: list[bytes] = []
        async with connect(f"ws://127.0.0.1:{port}", origin=origin, subprotocols=[PROTOCOL]) as connection:
            try:
                for content in sent:
                    await connection.send(content)
                while True:
                    received.append(await asyncio.wait_for(connection.recv(), timeout=0.5))
            except TimeoutError:
                pass
            except ConnectionClosed as closed:
                received.append(f"closed {closed.rcvd.code}".encode())
        return received

    return asyncio.run(run())


def test_it_listens_on_this_machine_only(server) -> None:
    assert server.get_host() == "127.0.0.1"
    own = socket.gethostbyname(socket.gethostname())
    if own.startswith("127."):
        pytest.skip("this machine has no other address")
    with pytest.raises(ConnectionRefusedError), socket.create_connection((own, server.get_port()), timeout=2):
        pass


def test_its_own_page_and_programs_get_the_scene(server) -> None:
    for origin in (f"http://127.0.0.1:{server.get_port()}", f"http://localhost:{server.get_port()}", None):
        received = talk(server.get_port(), origin)
        assert received
        assert not received[-1].startswith(b"closed")


@pytest.mark.parametrize("origin", ["https://evil.example", "http://127.0.0.1:1", "null"])
def test_a_page_from_elsewhere_gets_nothing(server, origin: str) -> None:
    assert talk(server.get_port(), origin) == [b"closed 1008"]


@pytest.mark.parametrize(
    ("origin", "host", "is_own"),
    [
        ("http://127.0.0.1:8080", "127.0.0.1", True),
        ("http://localhost:8080", "127.0.0.1", True),
        ("http://[::1]:8080", "::1", True),
        (None, "127.0.0.1", True),
        ("http://127.0.0.1:8081", "127.0.0.1", False),
        ("https://127.0.0.1:8080", "127.0.0.1", False),
        ("http://127.0.0.1.evil.example:8080", "127.0.0.1", False),
        ("http://evil.example:8080", "127.0.0.1", False),
        ("http://[::1", "127.0.0.1", False),
        ("http://127.0.0.1:port", "127.0.0.1", False),
        ("http://robot.lab:8080", "0.0.0.0", True),
    ],
)
def test_whose_page_it_is(origin: str | None, host: str, is_own: bool) -> None:
    assert is_own_page(origin, host, 8080) is is_own


def test_uploads_and_public_addresses_are_not_asked_for_by_anyone(server) -> None:
    handled = server._websock_server._incoming_handlers
    for name in ("FileTransferStartUpload", "FileTransferPart", "ShareUrlRequest", "ShareUrlDisconnect"):
        assert getattr(messages, name) not in handled
    assert messages.GuiUpdateMessage in handled
    talk(server.get_port(), None, msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
    assert server._share_tunnel is None


def test_garbage_harms_nobody_and_is_not_reported(server, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG - 1):
        talk(server.get_port(), None, b"\x00\xff garbage")
    assert [record for record in caplog.records if record.levelno >= logging.WARNING] == []
    assert talk(server.get_port(), None)


def test_files_outside_the_page_are_not_served(server) -> None:
    import http.client

    for path in ("/../infra/_infra.py", "/%2e%2e/package.json", "//etc/passwd"):
        asked = http.client.HTTPConnection("127.0.0.1", server.get_port(), timeout=5)
        asked.request("GET", path)
        assert asked.getresponse().status == 404
        asked.close()


def test_nothing_is_printed_and_no_thread_is_left(capfd: pytest.CaptureFixture[str]) -> None:
    before = set(threading.enumerate())
    server = open_server()
    talk(server.get_port(), None)
    close_server(server)
    close_server(server)
    assert [thread for thread in threading.enumerate() if thread not in before and thread.is_alive()] == []
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("host", ["203.0.113.7", "no such host", "a..b"])
def test_an_address_that_is_not_ours_is_refused(host: str) -> None:
    with pytest.raises(InvalidValueError, match="--host"):
        open_server(host=host)


def test_a_port_that_is_taken_is_refused() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as taken,
        pytest.raises(InvalidValueError, match="choose others, or port 0"),
    ):
        open_server(port=taken.getsockname()[1])
