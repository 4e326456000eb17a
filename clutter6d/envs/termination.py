"""When an episode ends, and whether it was a success; pure functions of poses, in NumPy or torch."""

from dataclasses import dataclass
from typing import Final, Generic, Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from clutter6d.arrays import Array, namespace
from clutter6d.errors import InvalidValueError
from clutter6d.geometry import rotation_error_rad

MAX_CONTROL_STEPS = 300
Outcome = Literal["success", "drop", "timeout", "unstable"]
"""How an episode ended; ``unstable``: the physics became invalid."""
OUTCOMES: Final[tuple[Outcome, ...]] = ("unstable", "success", "drop", "timeout")
"""All of them; of several that are true at once, the first counts."""


@dataclass(frozen=True, kw_only=True, slots=True)
class TerminationConfig:
    """The benchmark's thresholds.

    Attributes:
        position_tolerance_m: Success: distance to the goal, in 3-D, below this (paper, "Clutter6D": 0.05 m).
        rotation_tolerance_rad: Success: rotation error below this (paper, "Clutter6D": 0.1 rad).
        drop_m: Drop: an object's centre further than this below the table top.
        max_steps: Control steps after which an episode ends (paper, "Clutter6D": 300).
    """

    position_tolerance_m: float = 0.05
    rotation_tolerance_rad: float = 0.1
    drop_m: float = 0.05
    max_steps: int = MAX_CONTROL_STEPS

    def __post_init__(self) -> None:
        """Refuse an episode without steps."""
        if self.max_steps < 1:
            raise InvalidValueError(f"max steps is {self.max_steps}; an episode has at least 1 step")


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class GoalErrors(Generic[Array]):
    """How far targets are from their goals."""

    position_m: Float[Array, "slot"]
    planar_m: Float[Array, "slot"]
    rotation_rad: Float[Array, "slot"]


def goal_errors(target_poses: Float[Array, "slot 7"], goals: Float[Array, "slot 7"]) -> GoalErrors[Array]:
    """Distance in 3-D, distance on the table plane, and angle ``2 acos|q . q_goal|``."""
    xp = namespace(target_poses)
    x, y, z = (target_poses[:, axis] - goals[:, axis] for axis in range(3))
    return GoalErrors(
        position_m=xp.sqrt(x * x + y * y + z * z),
        planar_m=xp.sqrt(x * x + y * y),
        rotation_rad=rotation_error_rad(target_poses[:, 3:], goals[:, 3:]),
    )


def is_at_goal(
    distance_m: Float[Array, "slot"], rotation_rad: Float[Array, "slot"], config: TerminationConfig
) -> Bool[Array, "slot"]:
    """Whether distance and angle are within the tolerances, strictly."""
    return (distance_m < config.position_tolerance_m) & (rotation_rad < config.rotation_tolerance_rad)


def is_dropped(object_poses: Float[Array, "slot object 7"], config: TerminationConfig) -> Bool[Array, "slot"]:
    """Whether any object's centre is below the table top by more than ``drop_m``."""
    return namespace(object_poses).any(object_poses[..., 2] < -config.drop_m, axis=-1)


def outcome_numbers(
    *,
    is_success: Bool[Array, "slot"],
    dropped: Bool[Array, "slot"],
    is_unstable: Bool[Array, "slot"],
    steps: Int[Array, "slot"],
    config: TerminationConfig,
) -> Int[Array, "slot"]:
    """How each slot's episode ended, as an index of :data:`OUTCOMES`; -1 while it goes on.

    An invalid state is no success, whatever it looks like; a success at the last step, or while another object falls,
    is one.
    """
    xp = namespace(steps)
    numbers = xp.full_like(steps, -1)
    reasons = {"unstable": is_unstable, "success": is_success, "drop": dropped, "timeout": steps >= config.max_steps}
    for number, name in reversed(list(enumerate(OUTCOMES))):
        numbers = xp.where(reasons[name], xp.full_like(numbers, number), numbers)
    return numbers


def find_outcome(
    *,
    is_success: Bool[np.ndarray, "slot"],
    dropped: Bool[np.ndarray, "slot"],
    is_unstable: Bool[np.ndarray, "slot"],
    steps: Int[np.ndarray, "slot"],
    config: TerminationConfig,
) -> tuple[Outcome | None, ...]:
    """How each slot's episode ended, or ``None`` while it goes on; see :func:`outcome_numbers`."""
    numbers = outcome_numbers(
        is_success=is_success, dropped=dropped, is_unstable=is_unstable, steps=steps, config=config
    )
    return tuple(None if number < 0 else OUTCOMES[number] for number in numbers.tolist())
