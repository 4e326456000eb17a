"""Footprints on the table as support functions, so that thousands of placements are tested at once.

A convex set's support function h(d) is the largest d . p over its points. Two convex sets are apart if along some
direction one ends before the other begins. With a fixed fan of directions the test is exact up to the fan's spacing,
and errs only on the safe side: sets it calls apart are apart.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.spatial import ConvexHull

from clutter6d.assets.asset import Asset
from clutter6d.geometry import rotate

DIRECTION_COUNT = 64
_ANGLES = 2 * np.pi * np.arange(DIRECTION_COUNT) / DIRECTION_COUNT
DIRECTIONS = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)
_BLOCK = 32
"""Orientations whose points are projected at once: few enough to stay in the processor's cache."""
_OPPOSITE = (np.arange(DIRECTION_COUNT) + DIRECTION_COUNT // 2) % DIRECTION_COUNT


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Layout:
    """Objects seen from above, world frame, metres.

    Attributes:
        names: One name an object.
        positions: Planar positions of the objects' origins.
        supports: Support functions of the footprints about those positions.
        tops: Heights of the objects' highest points.
    """

    names: tuple[str, ...]
    positions: Float64[np.ndarray, "object 2"]
    supports: Float64[np.ndarray, "object direction"]
    tops: Float64[np.ndarray, "object"]

    def index(self, name: str) -> int:
        """Row of an object."""
        return self.names.index(name)

    def with_object(
        self, name: str, position: Float64[np.ndarray, "2"], support: Float64[np.ndarray, "direction"], top: float
    ) -> "Layout":
        """This layout and one object more."""
        return Layout(
            names=(*self.names, name),
            positions=np.concatenate([self.positions, position[None]]),
            supports=np.concatenate([self.supports, support[None]]),
            tops=np.append(self.tops, top),
        )

    def without(self, name: str) -> "Layout":
        """This layout without one object."""
        return self._rows([index for index, other in enumerate(self.names) if other != name])

    def only(self, name: str) -> "Layout":
        """One object of this layout."""
        return self._rows([self.index(name)])

    def _rows(self, keep: list[int]) -> "Layout":
        return Layout(
            names=tuple(self.names[index] for index in keep),
            positions=self.positions[keep],
            supports=self.supports[keep],
            tops=self.tops[keep],
        )


def empty_layout() -> Layout:
    """A layout of no objects."""
    return Layout(names=(), positions=np.zeros((0, 2)), supports=np.zeros((0, DIRECTION_COUNT)), tops=np.zeros(0))


def hull_points(asset: Asset) -> Float64[np.ndarray, "point 3"]:
    """Corners of the convex hull of an asset's collision parts, object frame."""
    points = np.concatenate([part.vertices for part in asset.parts]).astype(np.float64)
    return points[ConvexHull(points).vertices]


def footprint_supports(
    points: Float64[np.ndarray, "point 3"], quats: Float64[np.ndarray, "n 4"]
) -> tuple[Float64[np.ndarray, "n direction"], Float64[np.ndarray, "n 2"]]:
    """Support functions of the shadow of a rotated object about its origin.

    Returns:
        The support functions, and the lowest and highest z of the rotated object relative to its origin.
    """
    turned = rotate(quats[:, None, :], points[None])
    supports = np.empty((len(quats), DIRECTION_COUNT))
    for start in range(0, len(quats), _BLOCK):
        block = turned[start : start + _BLOCK]
        along = block[..., None, 0] * DIRECTIONS[:, 0]
        along += block[..., None, 1] * DIRECTIONS[:, 1]
        along.max(axis=1, out=supports[start : start + _BLOCK])
    return supports, np.stack([turned[..., 2].min(axis=1), turned[..., 2].max(axis=1)], axis=1)


def layout_of(names: tuple[str, ...], hulls: tuple[np.ndarray, ...], poses: Float64[np.ndarray, "object 7"]) -> Layout:
    """The layout of objects in given poses; ``hulls`` are their :func:`hull_points`."""
    shadows = [footprint_supports(hull, pose[None, 3:]) for hull, pose in zip(hulls, poses, strict=True)]
    return Layout(
        names=names,
        positions=poses[:, :2].copy(),
        supports=np.concatenate([support for support, _ in shadows]),
        tops=np.array([pose[2] + span[0, 1] for pose, (_, span) in zip(poses, shadows, strict=True)]),
    )


def separations_m(
    positions: Float64[np.ndarray, "n 2"],
    supports: Float64[np.ndarray, "#n direction"],
    layout: Layout,
) -> Float64[np.ndarray, "n object"]:
    """Free distance between candidate footprints and those of a layout; negative if they may overlap.

    For sets that are apart it never exceeds their true distance.
    """
    offset = positions[:, None, :] - layout.positions[None]
    gaps = offset[..., None, 0] * DIRECTIONS[:, 0]
    gaps += offset[..., None, 1] * DIRECTIONS[:, 1]
    gaps -= layout.supports
    gaps -= supports[:, None, _OPPOSITE]
    return gaps.max(axis=-1)


def swept_support(
    start: Float64[np.ndarray, "2"], end: Float64[np.ndarray, "2"], support: Float64[np.ndarray, "direction"]
) -> Float64[np.ndarray, "direction"]:
    """Support function, about the world origin, of a footprint pushed straight from start to end."""
    return np.maximum(DIRECTIONS @ start, DIRECTIONS @ end) + support
