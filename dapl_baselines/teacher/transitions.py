"""What a push did, as rows: kept in a replay, taken out with other goals and mirrored."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import torch
from jaxtyping import Bool, Float, Int, Real
from torch import Tensor

from clutter6d.envs.termination import TerminationConfig, goal_errors, is_at_goal
from clutter6d.geometry import quat_from_yaw, quat_multiply
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.push_state import STATE_FIELDS, PushState, to_tensor
from dapl_baselines.replay import Replay
from dapl_baselines.teacher.settings import GoalSettings

NO_LATER: Final = -1
MAX_HOPS: Final = 24
GOAL_AREA_M: Final = (0.20, 0.35)
"""|x|, |y| at most of goals that are moved at random."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Transitions:
    """Pushes, and what became of them; one row each.

    Attributes:
        before: When the push was chosen.
        after: When it was over.
        goals: Where the targets should go.
        pushes: The pushes.
        steps: Control steps that they took.
        is_success: Whether they ended at the goal.
        is_drop: Whether they ended with an object off the table.
        targets: Rows of the targets' shapes.
        later: Number of the same episode's next transition, or ``NO_LATER``.
        weights: 0 where the goal is reached before the push, 1 elsewhere.
    """

    before: PushState[np.ndarray]
    after: PushState[np.ndarray]
    goals: Float[np.ndarray, "row 7"]
    pushes: Float[np.ndarray, "row column"]
    steps: Real[np.ndarray, "row"]
    is_success: Bool[np.ndarray, "row"]
    is_drop: Bool[np.ndarray, "row"]
    targets: Int[np.ndarray, "row"]
    later: Int[np.ndarray, "row"]
    weights: Float[np.ndarray, "row"]

    def to_rows(self) -> dict[str, Tensor]:
        """As the replay keeps them; what does not change in an episode is kept once."""
        before = {f"before_{name}": getattr(self.before, name) for name in STATE_FIELDS}
        after = {f"after_{name}": getattr(self.after, name) for name in STATE_FIELDS if name != "physics"}
        others = {"goals": self.goals, "pushes": self.pushes, "steps": self.steps}
        flags = {"is_success": self.is_success, "is_drop": self.is_drop}
        rows = {name: to_tensor(array) for name, array in (before | after | others | flags).items()}
        numbers = {"targets": self.targets, "later": self.later}
        return rows | {name: torch.from_numpy(array.astype(np.int32)) for name, array in numbers.items()}

    @classmethod
    def of_rows(cls, rows: Mapping[str, Tensor]) -> "Transitions":
        """From rows of the replay."""
        arrays = {name: tensor.numpy() for name, tensor in rows.items()}
        arrays["after_physics"] = arrays["before_physics"]
        return cls(
            before=PushState(**{name: arrays[f"before_{name}"] for name in STATE_FIELDS}),
            after=PushState(**{name: arrays[f"after_{name}"] for name in STATE_FIELDS}),
            goals=arrays["goals"],
            pushes=arrays["pushes"],
            steps=arrays["steps"],
            is_success=arrays["is_success"] > 0,
            is_drop=arrays["is_drop"] > 0,
            targets=arrays["targets"],
            later=arrays["later"],
            weights=np.ones(len(arrays["steps"]), dtype=np.float32),
        )


def take_transitions(
    replay: Replay, numbers: Int[np.ndarray, "row"], end: int, settings: GoalSettings, rng: np.random.Generator
) -> Transitions:
    """Transitions of a replay, some of them with other goals.

    Args:
        replay: Where they are.
        numbers: Which.
        end: Transitions from this number on are not looked at: they are being added.
        settings: Which goals.
        rng: Where goals are drawn from.
    """
    found = Transitions.of_rows(replay.take(numbers, replay.fields))
    later = round(settings.later_share * len(numbers))
    moved = slice(later, later + round(settings.moved_share * len(numbers)))
    goals = found.goals.astype(np.float64)
    if later:
        goals[:later] = _later_poses(replay, numbers[:later], end, settings.later_hop, rng)
    goals[moved] = _moved_goals(goals[moved], found.before.poses[moved], settings.move_m, rng)
    changed = slice(0, moved.stop)
    is_success, weights = found.is_success.copy(), found.weights.copy()
    is_success[changed] = _is_there(found.after.poses[changed], goals[changed])
    weights[changed] = ~_is_there(found.before.poses[changed], goals[changed])
    return replace(found, goals=goals.astype(np.float32), is_success=is_success, weights=weights)


def mirrored(found: Transitions) -> Transitions:
    """The same in a world in which left is right; contact points and surfaces must be mirrored with them."""
    return replace(
        found,
        before=_mirrored_state(found.before),
        after=_mirrored_state(found.after),
        goals=found.goals * MIRROR_POSE,
        pushes=mirrored_pushes(found.pushes),
    )


MIRROR: Final = np.array([1.0, -1.0, 1.0], dtype=np.float32)
"""What the mirror does to a vector; a rotation axis or an angular velocity is turned the other way round as well."""
MIRROR_QUAT: Final = np.array([1.0, -1.0, 1.0, -1.0], dtype=np.float32)
MIRROR_POSE: Final = np.concatenate([MIRROR, MIRROR_QUAT])
_MIRROR_TWIST: Final = np.concatenate([MIRROR, -MIRROR])


def mirrored_pushes(pushes: Float[np.ndarray, "*n column"]) -> Float[np.ndarray, "*n column"]:
    """Pushes in the mirrored world; the hand is its own mirror image."""
    pushes = pushes.copy()
    for part in columns.VECTORS:
        pushes[..., part] *= MIRROR
    pushes[..., columns.HAND] *= MIRROR_QUAT
    return pushes


def _mirrored_state(state: PushState[np.ndarray]) -> PushState[np.ndarray]:
    return PushState(
        poses=state.poses * MIRROR_POSE,
        velocities=state.velocities * _MIRROR_TWIST,
        obstacles=np.concatenate([state.obstacles[..., :3] * MIRROR, state.obstacles[..., 3:]], axis=-1),
        physics=state.physics,
        tips=state.tips * MIRROR,
        tip_velocities=state.tip_velocities * MIRROR,
        hands=state.hands * MIRROR_QUAT,
    )


def _later_poses(
    replay: Replay, numbers: Int[np.ndarray, "row"], end: int, hop: float, rng: np.random.Generator
) -> Float[np.ndarray, "row 7"]:
    """Where the targets are after the push, or after one of those that follow it."""
    hops, current = rng.geometric(hop, size=len(numbers)), numbers.copy()
    for count in range(1, MAX_HOPS):
        following = replay.take(current, ["later"])["later"].numpy()
        goes_on = (hops > count) & (following > current) & (following < end)
        current = np.where(goes_on, following, current)
    return replay.take(current, ["after_poses"])["after_poses"].double().numpy()


def _moved_goals(
    goals: Float[np.ndarray, "row 7"], poses: Float[np.ndarray, "row 7"], move_m: float, rng: np.random.Generator
) -> Float[np.ndarray, "row 7"]:
    """The same resting faces, turned by any angle, anywhere around the target."""
    count = len(goals)
    turned = quat_multiply(quat_from_yaw(rng.uniform(-np.pi, np.pi, count)), goals[:, 3:])
    distance, angle = move_m * np.sqrt(rng.random(count)), rng.uniform(-np.pi, np.pi, count)
    x = np.clip(poses[:, 0] + distance * np.cos(angle), -GOAL_AREA_M[0], GOAL_AREA_M[0])
    y = np.clip(poses[:, 1] + distance * np.sin(angle), -GOAL_AREA_M[1], GOAL_AREA_M[1])
    return np.column_stack([x, y, goals[:, 2], turned])


def _is_there(poses: Float[np.ndarray, "row 7"], goals: Float[np.ndarray, "row 7"]) -> Bool[np.ndarray, "row"]:
    errors = goal_errors(poses.astype(np.float64), goals)
    return is_at_goal(errors.position_m, errors.rotation_rad, TerminationConfig())
