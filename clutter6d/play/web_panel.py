"""Controls of a played session on the page: which episode, which moment, how fast, from where."""

from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

from clutter6d.play.live_view import drain
from clutter6d.play.player import Request
from clutter6d.play.session import SPEEDS, PlaySession
from clutter6d.play.web_view import CAMERAS, WebView

_SPEEDS = {f"{speed:g}x": speed for speed in SPEEDS}


class WebPanel:
    """Moment, speed, scene, goal pair and camera; what a page sends that was not offered is ignored.

    Args:
        view: The page.
        session: What is played.
    """

    def __init__(self, view: WebView, session: PlaySession) -> None:
        gui = view.server.gui
        self._requests: SimpleQueue[Request] = SimpleQueue()
        self._moment = gui.add_slider("Moment", min=0, max=1, step=1, initial_value=0)
        self._speed = gui.add_dropdown("Speed", list(_SPEEDS), initial_value="1x")
        self._scene = gui.add_dropdown("Scene", session.playlist.scene_ids)
        self._pair = gui.add_dropdown("Goal pair", _names(session.pairs()))
        camera = gui.add_button_group("Camera", list(CAMERAS))
        self._listen(self._moment, self._seek)
        self._listen(self._speed, self._set_speed)
        self._listen(self._scene, self._select_scene)
        self._listen(self._pair, self._select_pair)
        camera.on_click(lambda event: view.look_from(CAMERAS.get(event.target.value, CAMERAS["episode"])))

    def requests(self) -> tuple[Request, ...]:
        """What was asked for since the last call."""
        return drain(self._requests)

    def refresh(self, session: PlaySession) -> None:
        """Show what the session shows."""
        chosen = session.selection
        self._moment.max = max(session.last_step, 1)
        self._moment.value = session.frame.step
        self._scene.value = chosen.scene_id
        if self._pair.options != _names(session.pairs()):
            self._pair.options = _names(session.pairs())
        self._pair.value = str(chosen.pair)

    def _listen(self, control: Any, use: Callable[[PlaySession, Any], None]) -> None:
        """Pass on what a person sets, and not what :meth:`refresh` does."""

        def on_update(event: Any) -> None:
            if event.client_id is not None:
                value = event.target.value
                self._requests.put(lambda session: use(session, value))

        control.on_update(on_update)

    def _seek(self, session: PlaySession, step: int) -> None:
        session.is_playing = False
        session.seek(step)

    def _set_speed(self, session: PlaySession, name: str) -> None:
        session.speed = _SPEEDS.get(name, session.speed)

    def _select_scene(self, session: PlaySession, scene_id: str) -> None:
        if scene_id in session.playlist.scene_ids:
            session.select(scene_id)

    def _select_pair(self, session: PlaySession, name: str) -> None:
        if name in _names(session.pairs()):
            session.select(session.selection.scene_id, int(name))


def _names(pairs: tuple[int, ...]) -> tuple[str, ...]:
    return tuple(str(pair) for pair in pairs)
