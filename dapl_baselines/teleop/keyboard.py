"""Driving by keyboard: each key moves the hand along or about one axis while it is held."""

import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from dapl_baselines.teleop.device import Command

HOLD_S = 0.15
"""A key counts as held for so long after it was seen: terminals repeat a held key every 30 to 50 ms and do not tell
when it is let go. The first repetition comes late, after 0.2 to 0.5 s: a single press is a nudge of one or two steps.
"""
MOVES = {
    "i": (0, 1),
    "k": (0, -1),
    "j": (1, 1),
    "l": (1, -1),
    "o": (2, 1),
    "u": (2, -1),
    "h": (3, 1),
    "f": (3, -1),
    "t": (4, 1),
    "g": (4, -1),
    "r": (5, 1),
    "y": (5, -1),
}
"""Axis and direction of each key; W A S D Q E stay free for the camera of a page in the browser."""
SPEEDS = {"1": 0.15, "2": 0.5, "3": 1.0}
"""Share of full speed."""


class KeyboardDevice:
    """The keyboard of the terminal, or of the viewer's page.

    Args:
        clock: Seconds that only grow.
    """

    name = "keyboard"
    settings: Mapping[str, object] = {"speeds": SPEEDS, "hold_s": HOLD_S}
    help_lines = (
        "i k\tthe finger tips away from you, back",
        "j l\tleft, right",
        "o u\tup, down",
        "t g\tlean the hand away from you, back",
        "f h\tlean it left, right",
        "r y\tturn it left, right",
        "1 2 3\tslow, normal, fast",
    )

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._held_until: dict[str, float] = {}
        self._speed = SPEEDS["2"]

    def connect(self) -> None:
        """Nothing is held."""
        self._held_until.clear()

    def read(self, keys: Sequence[str]) -> Command:
        """The sum of the keys that are held."""
        now = self._clock()
        for key in keys:
            self._speed = SPEEDS.get(key, self._speed)
            if key in MOVES:
                self._held_until[key] = now + HOLD_S
        deflection = np.zeros(6)
        for key, until in self._held_until.items():
            if now < until:
                axis, sign = MOVES[key]
                deflection[axis] += sign * self._speed
        return Command(deflection=np.clip(deflection, -1.0, 1.0))

    def close(self) -> None:
        """Nothing to let go of."""
        self._held_until.clear()
