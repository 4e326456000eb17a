"""Convex parts that a source knows from construction: taken only if they are convex."""

from collections.abc import Sequence

import manifold3d
import numpy as np

from clutter6d.assets.asset import Mesh
from clutter6d.assets.convex_part import hull_of

_INSIDE_SHARE = 0.02


def convex_hulls_of(parts: Sequence[Mesh]) -> list[manifold3d.Manifold] | None:
    """Hulls of the parts, or ``None`` if a part is flat or not convex: a vertex of it lies well inside its hull."""
    hulls: list[manifold3d.Manifold] = []
    for part in parts:
        points = part.vertices.astype(np.float64)
        hull = hull_of(points)
        if hull is None or not _is_convex(part, hull):
            return None
        hulls.append(hull)
    return hulls


def _is_convex(part: Mesh, hull: manifold3d.Manifold) -> bool:
    """Whether the part's own triangles enclose about as much as its hull."""
    corners = part.vertices.astype(np.float64)[part.faces]
    volume = float((corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])).sum() / 6)
    return abs(volume - hull.volume()) <= _INSIDE_SHARE * hull.volume()
