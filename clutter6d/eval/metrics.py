"""Numbers of an episode and of a table; pure functions."""

from math import sqrt

import numpy as np
from jaxtyping import Float, Float64
from scipy.spatial import KDTree

from clutter6d.assets.asset import Asset, SymmetryGroup
from clutter6d.geometry import quat_conjugate, quat_multiply, transform_points
from clutter6d.seeding import generator

NORMAL_QUANTILE_95 = 1.959963984540054
BOOTSTRAP_RESAMPLES = 2000


def symmetric_rotation_error_rad(
    quat: Float64[np.ndarray, "4"], goal: Float64[np.ndarray, "4"], symmetry: SymmetryGroup
) -> float:
    """Smallest angle to the goal among all rotations that leave the object looking the same (BOP convention).

    A rotation S of the symmetry group turns the object in its own frame, ``q S``. About a continuous axis ``a`` the
    minimum has a closed form: with ``(w, v)`` the quaternion of ``(q S)^-1 q_goal``, the largest scalar part that a
    further rotation about ``a`` can reach is ``sqrt(w^2 + (a . v)^2)`` (paper, "Symmetry-Aware Metric").

    Args:
        quat: The object's rotation, object frame to world frame.
        goal: The goal's rotation.
        symmetry: The object's symmetry group.

    Returns:
        Angle in [0, pi].
    """
    turned = quat_multiply(quat[None], symmetry.discrete_quats_wxyz)
    left = quat_multiply(quat_conjugate(turned), goal[None])
    scalar = np.abs(left[:, 0])
    if symmetry.continuous_axis is not None:
        x, y, z = symmetry.continuous_axis
        along = x * left[:, 1] + y * left[:, 2] + z * left[:, 3]
        scalar = np.sqrt(left[:, 0] ** 2 + along**2)
    return float(2 * np.arccos(np.clip(scalar.max(), 0.0, 1.0)))


def chamfer_distance_m(a: Float[np.ndarray, "n 3"], b: Float[np.ndarray, "m 3"]) -> float:
    """Symmetric Chamfer distance: the mean of the two directed means of Euclidean nearest-neighbour distances."""
    there, _ = KDTree(b).query(a)
    back, _ = KDTree(a).query(b)
    return float((there.mean() + back.mean()) / 2)


def mean_offset_cm(
    assets: tuple[Asset, ...], start_poses: Float64[np.ndarray, "object 7"], end_poses: Float64[np.ndarray, "object 7"]
) -> float:
    """Mean offset of the non-target objects in centimetres (paper, "Clutter6D": M.O.).

    The Chamfer distance between an object's canonical points at the start and at the end, averaged over all objects
    but the first; exactly 0 where poses are equal, and 0 without obstacles.
    """
    distances = [
        _offset_m(asset, start, end) for asset, start, end in zip(assets, start_poses, end_poses, strict=True)
    ][1:]
    return 100 * sum(distances) / len(distances) if distances else 0.0


def _offset_m(asset: Asset, start: Float64[np.ndarray, "7"], end: Float64[np.ndarray, "7"]) -> float:
    if np.array_equal(start, end):
        return 0.0
    points = asset.surface_points.astype(np.float64)
    return chamfer_distance_m(transform_points(start, points), transform_points(end, points))


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """95% Wilson score interval of a success rate; (0, 1) without trials."""
    if trials == 0:
        return (0.0, 1.0)
    rate, square = successes / trials, NORMAL_QUANTILE_95**2
    centre = (rate + square / (2 * trials)) / (1 + square / trials)
    half = NORMAL_QUANTILE_95 / (1 + square / trials) * sqrt(rate * (1 - rate) / trials + square / (4 * trials**2))
    low = 0.0 if successes == 0 else max(0.0, centre - half)
    return (low, 1.0 if successes == trials else min(1.0, centre + half))


def bootstrap_interval(values: Float64[np.ndarray, "n"], seed: int) -> tuple[float, float]:
    """95% percentile bootstrap interval of a mean.

    Args:
        values: The episodes' values, in the table's order.
        seed: Seed of the resampling.
    """
    if len(values) == 0:
        return (0.0, 0.0)
    rng = generator(seed, "bootstrap", len(values))
    means = [values[rng.integers(len(values), size=len(values))].mean() for _ in range(BOOTSTRAP_RESAMPLES)]
    low, high = np.quantile(means, [0.025, 0.975])
    return (float(low), float(high))
