"""Playing a session in a window: keys and buttons in, pictures and words out."""

import time
from collections.abc import Callable
from typing import Protocol, runtime_checkable

from clutter6d.physics import CONTROL_STEP_S
from clutter6d.play.live_view import Action, LiveView
from clutter6d.play.overlays import Overlay, overlay_points
from clutter6d.play.readout import describe
from clutter6d.play.session import PlaySession

ACTIONS = (
    Action(name="toggle", label="Play / pause", key="space"),
    Action(name="step", label="Step", key="enter"),
    Action(name="back", label="Back", key="B"),
    Action(name="restart", label="Restart", key="R"),
    Action(name="previous", label="Previous", key="pageup"),
    Action(name="next", label="Next", key="pagedown"),
    Action(name="points", label="Policy's points", key="P"),
    Action(name="contacts", label="Contacts", key="C"),
)
IDLE_S = 0.02
Request = Callable[[PlaySession], None]


def _step(session: PlaySession) -> None:
    session.is_playing = False
    session.step()


_USES: dict[str, Request] = {
    "toggle": PlaySession.toggle,
    "step": _step,
    "back": PlaySession.step_back,
    "restart": PlaySession.restart,
    "previous": lambda session: session.go(-1),
    "next": lambda session: session.go(1),
}
_OVERLAYS = {"points": Overlay.POINTS, "contacts": Overlay.CONTACTS}


@runtime_checkable
class Panel(Protocol):
    """Controls beyond keys and buttons."""

    def requests(self) -> tuple[Request, ...]:
        """What was asked for since the last call."""
        ...

    def refresh(self, session: PlaySession) -> None:
        """Show what the session shows."""
        ...


class Player:
    """Plays a session in a window until that is closed.

    Args:
        session: What is played.
        view: The window.
        is_paused: Wait for the person to let time run; by default it does as soon as someone looks.

    Attributes:
        panel: Further controls, below the buttons.
    """

    def __init__(self, session: PlaySession, view: LiveView, *, is_paused: bool = False) -> None:
        self._session, self._view = session, view
        self.panel: Panel | None = None
        view.offer(ACTIONS)
        self._overlay = Overlay.NONE
        self._waits_for_someone = not is_paused
        self._next_step = 0.0
        self._shown_pair: tuple[str, int] | None = None
        self._shown: tuple[object, ...] = ()

    def run(self) -> None:
        """Play until the window is closed.

        Raises:
            InvalidValueError: The policy failed.
        """
        while self._view.is_open:
            if not self.tick():
                time.sleep(IDLE_S)

    def tick(self) -> bool:
        """Do what was asked for, let time run, show what changed; returns whether anything did."""
        session = self._session
        if self._waits_for_someone and self._view.is_watched:
            self._waits_for_someone, session.is_playing = False, True
        for name in self._view.triggered():
            self._do(name)
        for request in self.panel.requests() if self.panel else ():
            request(session)
        if session.is_playing and time.monotonic() >= self._next_step:
            self._next_step = max(self._next_step + CONTROL_STEP_S / session.speed, time.monotonic())
            self._show()  # before the policy thinks
            session.step()
        return self._show()

    def _do(self, name: str) -> None:
        if name in _OVERLAYS:
            self._overlay ^= _OVERLAYS[name]
        else:
            _USES[name](self._session)

    def _show(self) -> bool:
        session, chosen = self._session, self._session.selection
        now = (session.frame, session.is_playing, session.speed, self._overlay)
        if now == self._shown:
            return False
        if (chosen.scene_id, chosen.pair) != self._shown_pair:
            self._shown_pair = chosen.scene_id, chosen.pair
            self._view.show(session.scene, session.playlist.scenes.assets_of(session.scene), chosen.pair)
        self._shown = now
        self._view.update(session.frame.qpos)
        self._view.draw_points(*overlay_points(self._overlay, session.frame, session.model))
        self._view.message(describe(session))
        if self.panel:
            self.panel.refresh(session)
        return True
