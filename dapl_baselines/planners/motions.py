"""Motions of an object towards its goal, from which pushes are drawn: move, tip over an edge, turn, or all at once."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from clutter6d.geometry import quat_conjugate, quat_from_yaw, quat_multiply, rotate
from dapl_baselines.planners.config import PushConfig

_FAR_TURN_RAD = 1.0
"""A push is meant for at most so much of a turn."""
_UPRIGHT_RAD = 0.2
"""An object tilted less rests on the right face."""
_ALIGNED_RAD = 0.06
"""An object turned less about the vertical needs no turning."""
_OVERHEAD_RAD = 2.6
"""An object tilted more stands on its head: it may tip over any edge."""
_LOW_M = 0.01
"""Points within this of the lowest one may be pivots."""
_MOVE, _TIP, _TURN, _ALL = range(4)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Motions:
    """Motions of the object that pushes are meant for.

    Attributes:
        wanted: Displacement that every surface point should make.
        tilts: Rotation vector of pushes meant to tip the object, zero for the others.
        pivots: A point of the edge about which it tips.
    """

    wanted: Float64[np.ndarray, "push point 3"]
    tilts: Float64[np.ndarray, "push 3"]
    pivots: Float64[np.ndarray, "push 3"]


def draw_motions(
    points: Float64[np.ndarray, "point 3"],
    target_pose: Float64[np.ndarray, "7"],
    goal: Float64[np.ndarray, "7"],
    count: int,
    config: PushConfig,
    rng: np.random.Generator,
) -> Motions:
    """Parts of the way to the goal, by the intent of each push.

    Tipping turns the object about the lowest edge ahead of it, turning about the vertical axis through its centre.
    """
    translation = (goal[:3] - target_pose[:3]) * np.array([1.0, 1.0, 0.0])
    tilt, twist = tilt_and_twist(target_pose[3:], goal[3:])
    angle = float(np.sqrt((tilt**2).sum()))
    shares = config.upright_shares if angle < _UPRIGHT_RAD else config.tipping_shares
    intent = rng.choice(4, size=count, p=np.array(shares))
    if angle < _UPRIGHT_RAD and abs(twist) < _ALIGNED_RAD:
        intent = np.full(count, _MOVE)
    moves, tips, turns = (((intent == kind) | (intent == _ALL))[:, None, None] for kind in (_MOVE, _TIP, _TURN))
    tilts = _spread_tilts(tilt, count, config, rng) * min(1.0, _FAR_TURN_RAD / max(angle, 1e-6))
    pivots = _pivots(points, tilts)
    tipping = np.cross(tilts[:, None], points - pivots[:, None])
    turning = np.clip(twist, -_FAR_TURN_RAD, _FAR_TURN_RAD) * np.cross([0.0, 0.0, 1.0], points - target_pose[:3])
    wanted = moves * translation + tips * tipping + turns * turning
    return Motions(wanted=wanted, tilts=np.where((intent == _TIP)[:, None], tilts, 0.0), pivots=pivots)


def _spread_tilts(
    tilt: Float64[np.ndarray, "3"], count: int, config: PushConfig, rng: np.random.Generator
) -> Float64[np.ndarray, "push 3"]:
    """The tilt, its axis turned a little about the vertical; by any angle if the object stands on its head."""
    angle = float(np.sqrt((tilt**2).sum()))
    spread = (
        np.pi * rng.uniform(-1, 1, count) if angle > _OVERHEAD_RAD else config.axis_noise_rad * rng.normal(size=count)
    )
    return rotate(quat_from_yaw(spread), tilt)


def _pivots(
    points: Float64[np.ndarray, "point 3"], tilts: Float64[np.ndarray, "push 3"]
) -> Float64[np.ndarray, "push 3"]:
    """Of the points near the table, the one furthest ahead in the direction in which each tilt carries the top."""
    ahead = np.cross(tilts, [0.0, 0.0, 1.0])
    advance = (ahead[:, None] * points).sum(axis=-1)
    is_low = points[:, 2] < points[:, 2].min() + _LOW_M
    return points[np.where(is_low, advance, -np.inf).argmax(axis=-1)]


def tilt_and_twist(
    start: Float64[np.ndarray, "4"], goal: Float64[np.ndarray, "4"]
) -> tuple[Float64[np.ndarray, "3"], float]:
    """The turn from ``start`` to ``goal`` as a turn about a horizontal axis, then one about the vertical.

    Returns:
        The horizontal rotation vector and the angle about the vertical axis [rad].
    """
    turn = quat_multiply(goal, quat_conjugate(start))
    turn = turn if turn[0] >= 0 else -turn
    upright = float(np.hypot(turn[0], turn[3]))
    twist = 2 * float(np.arctan2(turn[3], turn[0]))
    untwisted = quat_multiply(quat_from_yaw(-twist), turn)
    axis = np.array([untwisted[1], untwisted[2], 0.0])
    sine = float(np.sqrt((axis**2).sum()))
    tilt = np.zeros(3) if sine < 1e-9 else 2 * np.arctan2(sine, upright) * axis / sine
    return tilt, (twist + np.pi) % (2 * np.pi) - np.pi
