"""Convex hulls: made, cut down to few vertices, and checked."""

import manifold3d
import numpy as np
from jaxtyping import Float

from clutter6d.assets.solid import manifold_arrays

MIN_THICKNESS_M = 1e-4
_NEGLIGIBLE_M = 1e-4
_VOLUME_LOSS = 0.02
_MAX_SCALE = 1.08


def hull_of(points: Float[np.ndarray, "point 3"]) -> manifold3d.Manifold | None:
    """The convex hull, or ``None`` if the points are flat to a tenth of a millimetre."""
    if len(points) < 4:
        return None
    centred = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    if np.ptp(centred @ axes[2]) < MIN_THICKNESS_M:
        return None
    hull = manifold3d.Manifold.hull_points(np.asarray(points, dtype=np.float64))
    return None if hull.is_empty() or hull.volume() <= 0 else hull


def part_vertices(hull: manifold3d.Manifold) -> Float[np.ndarray, "vertex 3"]:
    """Vertices of a hull."""
    return manifold_arrays(hull)[0]


def reduce_hull(points: Float[np.ndarray, "point 3"], max_vertices: int) -> manifold3d.Manifold | None:
    """The hull of the points with at most so many vertices, or ``None`` if it is flat.

    Fewer vertices cut round shapes short (a ball of 32 loses a sixth). A hull that loses more than a fiftieth of its
    volume is scaled about its centre to have it back, so that its surface lies as much outside as inside.
    """
    whole, reduced = hull_of(points), hull_of(reduce_vertices(points, max_vertices))
    if whole is None or reduced is None or reduced.volume() >= (1 - _VOLUME_LOSS) * whole.volume():
        return reduced
    vertices = part_vertices(reduced)
    centre = vertices.mean(axis=0)
    factor = min((whole.volume() / reduced.volume()) ** (1 / 3), _MAX_SCALE)
    return hull_of(centre + factor * (vertices - centre))


def reduce_vertices(points: Float[np.ndarray, "point 3"], max_vertices: int) -> Float[np.ndarray, "vertex 3"]:
    """A subset of a convex hull's vertices that spans nearly the same hull.

    Starts from the extreme points along the axes and adds the vertex that sticks out most, until none sticks out by
    a tenth of a millimetre or the limit is reached. A subset never grows the part, and flat faces stay flat.
    """
    directions = np.concatenate([np.eye(3), -np.eye(3), _CORNERS])
    extreme = np.argmax(_rounded(points @ directions.T), axis=0)
    chosen = list(dict.fromkeys(int(index) for index in extreme))[:max_vertices]
    while len(chosen) < min(max_vertices, len(points)):
        hull = manifold3d.Manifold.hull_points(np.asarray(points[chosen], dtype=np.float64))
        outside = _height_outside(points, hull) if not hull.is_empty() else _spread(points, chosen)
        outside[chosen] = 0.0
        farthest = int(np.argmax(_rounded(outside)))
        if outside[farthest] < _NEGLIGIBLE_M:
            break
        chosen.append(farthest)
    return points[chosen]


_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / np.sqrt(3)


def _height_outside(points: Float[np.ndarray, "point 3"], hull: manifold3d.Manifold) -> Float[np.ndarray, "point"]:
    vertices, faces = manifold_arrays(hull)
    normals = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.maximum(lengths, 1e-300)
    heights = points @ normals.T - (normals * vertices[faces[:, 0]]).sum(axis=1)
    return heights[:, lengths[:, 0] > 0].max(axis=1)


def _rounded(lengths_m: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """To a nanometre, so that which of several equal lengths is the longest does not depend on the processor."""
    return np.round(lengths_m, 9)


def _spread(points: Float[np.ndarray, "point 3"], chosen: list[int]) -> Float[np.ndarray, "point"]:
    """Distance to the nearest chosen point: a first guide while the chosen ones are flat."""
    return np.linalg.norm(points[:, None] - points[chosen][None], axis=2).min(axis=1)
