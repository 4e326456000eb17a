"""Driving by gamepad, through SDL, which knows where the sticks and buttons of each model are."""

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from clutter6d.errors import MissingDependencyError
from dapl_baselines.teleop.device import Command, DeviceLostError, Wish

DEAD_BAND = 0.12
"""Share of a stick's way: worn sticks rest this far off their centre."""
_FULL = 32767
_NO_WINDOW = {
    "SDL_VIDEODRIVER": "dummy",
    "SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS": "1",
    "PYGAME_HIDE_SUPPORT_PROMPT": "1",
}


class GamepadDevice:
    """The first gamepad that is plugged in."""

    name = "gamepad"
    settings: Mapping[str, object] = {"dead_band": DEAD_BAND}
    help_lines = (
        "left stick\tthe finger tips away from you, back, left, right",
        "triggers\tright: up, left: down",
        "right stick\tlean the hand away from you, back; turn it",
        "shoulder buttons\tlean it left, right",
        "start\tstart, pause, go on",
        "back\tgive up, twice",
    )

    def __init__(self) -> None:
        self._sdl: Any = None
        self._pad: Any = None
        self._pressed: frozenset[int] = frozenset()

    def connect(self) -> None:
        """Start SDL without a window, and open the first gamepad."""
        self.close()
        self._sdl = _start_sdl()
        pads = [index for index in range(self._sdl.joystick.get_count()) if _controller().is_controller(index)]
        if not pads:
            raise DeviceLostError("no gamepad is plugged in, or its file in /dev/input may not be read")
        self._pad, self._pressed = _controller().Controller(pads[0]), frozenset()

    def read(self, keys: Sequence[str]) -> Command:  # noqa: ARG002  it has buttons of its own
        """Sticks and triggers as they are, and the buttons that were pressed."""
        if self._pad is None:
            raise DeviceLostError("the gamepad is not open; plug it in again")
        self._sdl.event.pump()
        if not self._pad.attached():
            raise DeviceLostError("the gamepad is gone; plug it in again")
        return Command(deflection=self._deflection(), wishes=self._wishes())

    def close(self) -> None:
        """Let go of the gamepad."""
        if self._pad is not None:
            self._pad.quit()
            self._pad = None

    def _deflection(self) -> np.ndarray:
        sdl = self._sdl
        away, right = -self._axis(sdl.CONTROLLER_AXIS_LEFTY), self._axis(sdl.CONTROLLER_AXIS_LEFTX)
        up = self._axis(sdl.CONTROLLER_AXIS_TRIGGERRIGHT) - self._axis(sdl.CONTROLLER_AXIS_TRIGGERLEFT)
        lean, turn = -self._axis(sdl.CONTROLLER_AXIS_RIGHTY), -self._axis(sdl.CONTROLLER_AXIS_RIGHTX)
        roll = self._is_down(sdl.CONTROLLER_BUTTON_RIGHTSHOULDER) - self._is_down(sdl.CONTROLLER_BUTTON_LEFTSHOULDER)
        return np.array([away, -right, up, float(roll), lean, turn])

    def _wishes(self) -> tuple[Wish, ...]:
        meanings: dict[int, Wish] = {
            self._sdl.CONTROLLER_BUTTON_START: "toggle",
            self._sdl.CONTROLLER_BUTTON_BACK: "give_up",
        }
        down = frozenset(button for button in meanings if self._is_down(button))
        newly, self._pressed = down - self._pressed, down
        return tuple(meanings[button] for button in sorted(newly))

    def _axis(self, axis: int) -> float:
        share = max(-1.0, self._pad.get_axis(axis) / _FULL)
        return float(np.sign(share) * max(abs(share) - DEAD_BAND, 0.0) / (1 - DEAD_BAND))

    def _is_down(self, button: int) -> int:
        return int(self._pad.get_button(button))


def _start_sdl() -> Any:
    """SDL's Python module, with its joystick part running."""
    for name, value in _NO_WINDOW.items():
        os.environ.setdefault(name, value)
    try:
        import pygame
    except ImportError:
        raise MissingDependencyError('gamepads need pygame-ce; run: pip install "clutter6d[teleop]"') from None
    try:
        pygame.display.init()
        pygame.joystick.init()
        _controller().init()
    except pygame.error as error:
        raise DeviceLostError(f"SDL, which reads gamepads, does not start: {error}") from None
    pygame.event.pump()
    return pygame


def _controller() -> Any:
    from pygame._sdl2 import controller

    return controller
