"""What the person is told: one line in the terminal, some lines beside the scene."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from clutter6d.envs.termination import TerminationConfig

Phase = Literal["ready", "driving", "paused"]
KEY_LINES = (
    "Enter or Space\tstart, pause, go on",
    "Backspace\tgive up, twice",
    "X\tleave; everything is kept",
)
_SAID: dict[Phase, str] = {
    "ready": "READY: Enter starts",
    "driving": "DRIVING",
    "paused": "PAUSED: Enter goes on",
}


@dataclass(frozen=True, kw_only=True, slots=True)
class Status:
    """Where an attempt stands.

    Attributes:
        scene_id: Its scene.
        pair: Its goal pair.
        number: Which attempt this is, from 1.
        total: How many there are.
        step: Control steps made.
        max_steps: Control steps there are.
        position_error_m: Distance of the target to its goal.
        rotation_error_rad: Angle to it.
        phase: Whether time goes on.
        note: What else is to be said.
    """

    scene_id: str
    pair: int
    number: int
    total: int
    step: int
    max_steps: int
    position_error_m: float
    rotation_error_rad: float
    phase: Phase
    note: str = ""

    @property
    def steps_left(self) -> int:
        """Control steps that are left."""
        return self.max_steps - self.step


def to_line(status: Status) -> str:
    """What changes all the time, in one line that fits a narrow terminal."""
    return f"{_SAID[status.phase]} | {status.steps_left:3d} steps left | {_errors(status)} to the goal"


def to_page(status: Status, help_lines: Sequence[str]) -> str:
    """The status and the keys in lines, each a name, a tab and a value."""
    limits = TerminationConfig()
    goal = f"{100 * limits.position_tolerance_m:.0f} cm, {np.rad2deg(limits.rotation_tolerance_rad):.1f}°"
    lines = (
        f"{_SAID[status.phase]}\t{status.note}",
        f"attempt\t{status.number} of {status.total}: {status.scene_id} pair {status.pair}",
        f"to the goal\t{_errors(status)} (success below {goal})",
        f"steps left\t{status.steps_left} of {status.max_steps}",
        *KEY_LINES,
        *help_lines,
    )
    return "\n".join(lines)


def _errors(status: Status) -> str:
    return f"{100 * status.position_error_m:.1f} cm, {np.rad2deg(status.rotation_error_rad):.0f}°"
