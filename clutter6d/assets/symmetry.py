"""Rotational symmetries of a shape, found by trying: rotate, and measure how far the surface moved.

Candidates are the inertia's principal axes and the axes of the shape's own frame; where two principal moments agree,
also directions between them. A continuous axis stands for all rotations about it, as in the BOP convention.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float64, Int

from clutter6d.assets.asset import SymmetryGroup
from clutter6d.assets.surface_distance import SurfaceDistance, sample_surface
from clutter6d.geometry import IDENTITY_QUAT, quat_from_axis_angle, quat_multiply, rotate, rotation_error_rad
from clutter6d.seeding import generator

MAX_ROTATIONS = 24
_FOLDS = (2, 3, 4, 5, 6, 8)
_TURNS_OF_CONTINUOUS = (0.37, 1.1, 1.9, 2.7)
_SAME_ROTATION_RAD = 0.05


@dataclass(frozen=True, kw_only=True, slots=True)
class SymmetrySettings:
    """When a rotation counts as a symmetry.

    Attributes:
        tolerance: Largest distance of a rotated point from the surface, as a share of the longest side.
        points: Points tried.
        similar_moments: Relative difference below which two principal moments agree.
    """

    tolerance: float = 0.025
    points: int = 600
    similar_moments: float = 0.08


def find_symmetries(
    vertices: Float[np.ndarray, "vertex 3"],
    faces: Int[np.ndarray, "face 3"],
    inertia: Float64[np.ndarray, "3 3"],
    settings: SymmetrySettings | None = None,
) -> SymmetryGroup:
    """Rotations about the origin (the centre of mass) that leave a surface where it is.

    Args:
        vertices: Vertices in the object frame [m].
        faces: Triangles.
        inertia: Inertia about the origin, of any mass.
        settings: When a rotation counts.
    """
    settings = settings or SymmetrySettings()
    surface = SurfaceDistance(vertices, faces, samples=8_000)
    drawn, _ = sample_surface(vertices, faces, settings.points, generator(0, "symmetry"))
    far = vertices[np.argsort(-np.linalg.norm(vertices, axis=1))[:50]]
    trial = _Trial(surface, np.concatenate([drawn, far]), settings.tolerance * float(np.ptp(vertices, axis=0).max()))
    axes = _candidate_axes(inertia, settings.similar_moments)
    continuous = next((axis for axis in axes if trial.is_continuous(axis)), None)
    if continuous is not None:
        return rounded(_with_axis(trial, continuous))
    rotations = [
        _turn(axis, 2 * np.pi / fold) for axis in axes for fold in _FOLDS if trial.holds(axis, 2 * np.pi / fold)
    ]
    return rounded(SymmetryGroup(discrete_quats_wxyz=_closure(rotations), continuous_axis=None))


def rounded(group: SymmetryGroup) -> SymmetryGroup:
    """To nine decimals: the principal axes of inertia differ in their last digits between processors."""
    quats, axis = np.round(group.discrete_quats_wxyz, 9) + 0.0, group.continuous_axis
    if axis is not None:
        x, y, z = (float(value) for value in np.round(axis, 9) + 0.0)
        axis = (x, y, z)
    return SymmetryGroup(discrete_quats_wxyz=quats, continuous_axis=axis)


class _Trial:
    def __init__(self, surface: SurfaceDistance, points: Float[np.ndarray, "point 3"], tolerance_m: float) -> None:
        self._surface, self._points, self._tolerance_m = surface, points, tolerance_m

    def holds(self, axis: Float[np.ndarray, "3"], angle: float) -> bool:
        few = self._points[::12]
        for points in (few, self._points):
            _, distance = self._surface.closest(rotate(_turn(axis, angle), points), neighbours=3)
            if float(np.quantile(distance, 0.99)) > self._tolerance_m:
                return False
        return True

    def is_continuous(self, axis: Float[np.ndarray, "3"]) -> bool:
        return all(self.holds(axis, angle) for angle in _TURNS_OF_CONTINUOUS)


def _turn(axis: Float[np.ndarray, "3"], angle: float) -> Float64[np.ndarray, "4"]:
    return quat_from_axis_angle(axis, angle)


def _candidate_axes(inertia: Float64[np.ndarray, "3 3"], similar: float) -> list[Float64[np.ndarray, "3"]]:
    moments, columns = np.linalg.eigh(inertia)
    principal = list(columns.T)
    axes = [*principal, *np.eye(3)]
    for first, second in ((0, 1), (1, 2), (0, 2)):
        if abs(moments[first] - moments[second]) <= similar * moments[second]:
            angles = np.pi / 24 * np.arange(1, 24)
            axes += [np.cos(a) * principal[first] + np.sin(a) * principal[second] for a in angles]
    kept: list[np.ndarray] = []
    for axis in axes:
        if all(abs(float(axis @ other)) < 0.9995 for other in kept):
            kept.append(axis)
    return kept


def _with_axis(trial: _Trial, axis: Float64[np.ndarray, "3"]) -> SymmetryGroup:
    """A continuous axis, and the half turn across it where that holds too."""
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    quats = [np.array(IDENTITY_QUAT)] + ([_turn(across, np.pi)] if trial.holds(across, np.pi) else [])
    x, y, z = (float(value) for value in axis)
    return SymmetryGroup(discrete_quats_wxyz=np.array(quats), continuous_axis=(x, y, z))


def _closure(rotations: list[Float64[np.ndarray, "4"]]) -> Float64[np.ndarray, "rotation 4"]:
    """All products of the rotations, the identity first; no more than a cube has."""
    group = [np.array(IDENTITY_QUAT)]
    frontier = list(group)
    while frontier:
        products = [quat_multiply(rotation, known) for known in frontier for rotation in rotations]
        frontier = []
        for product in products:
            if len(group) < MAX_ROTATIONS and (
                rotation_error_rad(product[None], np.array(group)).min() > _SAME_ROTATION_RAD
            ):
                group.append(product)
                frontier.append(product)
    return np.array(group)
