"""What makes a goal hard, as pure functions of poses and footprints (benchmark: "Tracks").

A push along the table turns an object about the vertical only. Its tilt, the angle between the directions that point up
before and after in the object's own frame, is then zero: tilt is what pushing in the plane cannot give.
"""

import numpy as np
from jaxtyping import Float64

from clutter6d.assets.asset import SymmetryGroup
from clutter6d.geometry import quat_conjugate, rotate
from clutter6d.scenegen.footprint import DIRECTION_COUNT, DIRECTIONS, swept_support
from clutter6d.scenegen.track import Region

PLANAR_TILT_RAD = 0.1
"""Largest tilt that a planar push may leave: the benchmark's tolerance of a goal's orientation."""
NEIGHBOUR_M = 0.05
"""An obstacle this near to the target or to its path is met when the hand, or the target, passes."""
_CELL_M = 0.01
_UP = np.array([0.0, 0.0, 1.0])


def up_in_object(quats: Float64[np.ndarray, "n 4"]) -> Float64[np.ndarray, "n 3"]:
    """The world's vertical in the object's frame; what a resting face is told by."""
    return rotate(quat_conjugate(quats), np.broadcast_to(_UP, (len(quats), 3)))


def tilt_rad(initial: Float64[np.ndarray, "n 4"], goal: Float64[np.ndarray, "n 4"]) -> Float64[np.ndarray, "n"]:
    """Angle that remains of the rotation from initial to goal once the best turn about the vertical is undone.

    Args:
        initial: Rotations at the start, object frame to world frame.
        goal: Rotations at the goal.

    Returns:
        Angles in [0, pi].
    """
    return _angle(up_in_object(initial), up_in_object(goal))


def symmetric_tilt_rad(
    initial: Float64[np.ndarray, "n 4"], goal: Float64[np.ndarray, "n 4"], symmetry: SymmetryGroup
) -> Float64[np.ndarray, "n"]:
    """The smallest tilt to a goal that looks like the given one (BOP convention of symmetries).

    A symmetry S may be put between: the goal ``q S`` looks like ``q``, and its vertical in the object's frame is turned
    by the inverse of S. About a continuous axis the start's vertical may besides be turned freely, which leaves the
    difference of the two angles to that axis.

    Args:
        initial: Rotations at the start, object frame to world frame.
        goal: Rotations at the goal.
        symmetry: The object's symmetries.

    Returns:
        Angles in [0, pi].
    """
    before, after = up_in_object(initial)[:, None], up_in_object(goal)[:, None]
    alike = rotate(quat_conjugate(symmetry.discrete_quats_wxyz)[None], after)
    if symmetry.continuous_axis is None:
        return _angle(before, alike).min(axis=1)
    axis = np.array(symmetry.continuous_axis)
    return np.abs(_angle(before, axis) - _angle(alike, axis)).min(axis=1)


def _angle(a: Float64[np.ndarray, "*#n 3"], b: Float64[np.ndarray, "*#n 3"]) -> Float64[np.ndarray, "*n"]:
    """Angle between unit vectors, exact for small angles too."""
    cross = np.cross(a, b)
    return np.asarray(np.arctan2(np.sqrt((cross * cross).sum(axis=-1)), (a * b).sum(axis=-1)))


def gaps_m(
    positions: Float64[np.ndarray, "n 2"],
    supports: Float64[np.ndarray, "n direction"],
    other_positions: Float64[np.ndarray, "n other 2"],
    other_supports: Float64[np.ndarray, "n other direction"],
) -> Float64[np.ndarray, "n other"]:
    """Free distance of one footprint from others, in each of n layouts; negative if they may overlap.

    The distance is that of :func:`clutter6d.scenegen.footprint.separations_m`: never more than the true one.
    """
    along = (positions[:, None] - other_positions) @ DIRECTIONS.T
    opposite = np.roll(supports, DIRECTION_COUNT // 2, axis=-1)
    return (along - other_supports - opposite[:, None]).max(axis=-1)


def path_gaps_m(
    starts: Float64[np.ndarray, "n 2"],
    ends: Float64[np.ndarray, "n 2"],
    supports: Float64[np.ndarray, "n direction"],
    other_positions: Float64[np.ndarray, "n other 2"],
    other_supports: Float64[np.ndarray, "n other direction"],
) -> Float64[np.ndarray, "n other"]:
    """Free distance of others from what a footprint sweeps when pushed straight; not positive where one is in the way.

    Args:
        starts: Positions of the target's origin at the start.
        ends: Its positions at the goal.
        supports: Its footprint at the start.
        other_positions: Positions of the obstacles.
        other_supports: Their footprints.
    """
    swept = np.stack([swept_support(*row) for row in zip(starts, ends, supports, strict=True)])
    return gaps_m(np.zeros_like(starts), swept, other_positions, other_supports)


def covered_share(
    positions: Float64[np.ndarray, "object 2"], supports: Float64[np.ndarray, "object direction"], region: Region
) -> float:
    """Share of a region of the table that footprints cover, on a grid of 1 cm."""
    x, y = (np.arange(low + _CELL_M / 2, high, _CELL_M) for low, high in (region.x, region.y))
    along = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2) @ DIRECTIONS.T
    covered = np.zeros(len(along), dtype=bool)
    for reach in positions @ DIRECTIONS.T + supports:
        covered |= (along <= reach).all(axis=1)
    return float(covered.mean())
