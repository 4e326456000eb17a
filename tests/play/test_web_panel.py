"""What a page may set, and what becomes of what it may not."""

import asyncio
from collections.abc import Iterator

import msgspec
import pytest
from websockets.asyncio.client import connect

from clutter6d.play.player import Player
from clutter6d.play.session import PlaySession
from clutter6d.play.web_panel import WebPanel
from clutter6d.play.web_view import WebView
from tests.play.played import make_playlist

CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [1, 1, 1], "fov": 1.0, "near": 0.1, "far": 10.0,
    "image_height": 10, "image_width": 10, "look_at": [0, 0, 0], "up_direction": [0, 0, 1],
}  # fmt: skip


class Page:
    """A player with its page, and a client that speaks for itself."""

    def __init__(self) -> None:
        self.view = WebView()
        self.session = PlaySession(make_playlist(), ("boxes-0", 1))
        self.player = Player(self.session, self.view, is_paused=True)
        self.panel = self.player.panel = WebPanel(self.view, self.session)
        self.player.tick()

    def set(self, control, value) -> None:
        """Set a control as a client does, and let the player take notice."""
        asyncio.run(self._send(control._impl.uuid, value))
        self.player.tick()

    async def _send(self, uuid: str, value) -> None:
        update = {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}}
        address = f"ws://127.0.0.1:{self.view.server.get_port()}"
        async with connect(address, subprotocols=["viser-v1.1.1"]) as client:
            for message in (CAMERA, update):
                await client.send(msgspec.msgpack.encode(message))
                await asyncio.sleep(0.15)


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    page = Page()
    yield page
    page.view.close()


def test_scene_pair_moment_and_speed_are_chosen(page: Page) -> None:
    page.set(page.panel._scene, "boxes-2")
    assert (page.session.selection.scene_id, page.session.selection.pair) == ("boxes-2", 0)
    page.set(page.panel._pair, "1")
    assert page.session.selection.pair == 1
    assert page.panel._pair.value == "1"
    page.session.step(2)
    page.player.tick()
    assert (page.panel._moment.value, page.panel._moment.max) == (2, 2)
    page.set(page.panel._moment, 1)
    assert page.session.frame.step == 1
    page.set(page.panel._speed, "4x")
    assert page.session.speed == 4


@pytest.mark.parametrize("control", ["_scene", "_pair", "_speed", "_moment"])
def test_what_was_not_offered_is_ignored(page: Page, control: str) -> None:
    before = (page.session.selection, page.session.speed)
    for value in (10**9, -1, "../../etc/passwd", "²"):
        if control == "_moment" and isinstance(value, str):
            continue
        page.set(getattr(page.panel, control), value)
        assert (page.session.selection, page.session.speed) == before
        assert 0 <= page.session.frame.step <= page.session.last_step


def test_showing_a_moment_asks_for_nothing(page: Page) -> None:
    page.session.go(1)
    page.player.tick()
    assert page.panel.requests() == ()
