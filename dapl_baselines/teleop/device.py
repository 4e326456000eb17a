"""What an input device is, and what it says at one control step."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float64

from clutter6d.errors import UserError

Wish = Literal["toggle", "give_up", "quit"]
"""What a person may want beside moving: start, pause or go on; give the attempt up; leave and go on another day."""


class DeviceLostError(UserError):
    """A device cannot be read: it is not there, was unplugged, has fallen silent or talks nonsense."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Command:
    """What a device says; of ``deflection`` and ``joints`` at most one is given, and neither asks for no movement.

    Attributes:
        deflection: Of full speed, -1 to 1, in the person's axes: translation of the finger tips away from the person,
            to their left and up, then rotation about these axes.
        joints: Joint angles to go to [rad].
        wishes: What was asked for since the last command, in order.
    """

    deflection: Float64[np.ndarray, "6"] | None = None
    joints: Float64[np.ndarray, "7"] | None = None
    wishes: tuple[Wish, ...] = ()


@runtime_checkable
class TeleopDevice(Protocol):
    """Something that a person moves; read once a control step, never waited for longer than a part of one."""

    @property
    def name(self) -> str:
        """What ``--device`` calls it."""
        ...

    @property
    def settings(self) -> Mapping[str, object]:
        """Everything that decides what its commands mean, as JSON-like values; part of the policy's hash."""
        ...

    @property
    def help_lines(self) -> tuple[str, ...]:
        """How to drive with it: a control, a tab and what it does, one a line."""
        ...

    def connect(self) -> None:
        """Open it; once more after it was lost.

        Raises:
            DeviceLostError: It is not there, or may not be opened.
            MissingDependencyError: The package that reads it is not installed.
        """
        ...

    def read(self, keys: Sequence[str]) -> Command:
        """What the person wants now.

        Args:
            keys: Keys pressed since the last call; the keyboard's movement is made of them, other devices ignore them.

        Raises:
            DeviceLostError: It was unplugged or does not answer.
        """
        ...

    def close(self) -> None:
        """Let go of it; more than once is no error."""
        ...
