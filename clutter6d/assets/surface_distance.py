"""Distances to a triangle surface, exact to the nearest triangles of a dense sample."""

import numpy as np
import trimesh
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from clutter6d.seeding import generator


def sample_surface(
    vertices: Float[np.ndarray, "vertex 3"], faces: Int[np.ndarray, "face 3"], count: int, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "point 3"], Int[np.ndarray, "point"]]:
    """Points drawn uniformly by area.

    Returns:
        Points, and the face that each lies on.
    """
    corners = vertices[faces].astype(np.float64)
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = np.linalg.norm(np.cross(first, second), axis=1)
    steps = np.cumsum(areas)
    chosen = np.minimum(np.searchsorted(steps, rng.random(count) * steps[-1], side="right"), len(faces) - 1)
    u, v = rng.random(count), rng.random(count)
    outside = u + v > 1
    u, v = np.where(outside, 1 - u, u)[:, None], np.where(outside, 1 - v, v)[:, None]
    return corners[chosen, 0] + u * first[chosen] + v * second[chosen], chosen


class SurfaceDistance:
    """Distance from points to a surface.

    The nearest triangles are found through sample points on the surface; the distance to them is exact. It is an
    upper bound, off by at most the spacing of the samples where a nearer triangle has none of the nearest samples.

    Args:
        vertices: Vertices [m].
        faces: Triangles.
        samples: Sample points; the vertices are added to them.
    """

    def __init__(
        self, vertices: Float[np.ndarray, "vertex 3"], faces: Int[np.ndarray, "face 3"], *, samples: int = 20_000
    ) -> None:
        points, on_face = sample_surface(vertices, faces, samples, generator(0, "surface-distance"))
        corner_points, corner_faces = np.unique(faces.ravel(), return_index=True)
        self._triangles = vertices[faces].astype(np.float64)
        self._faces = np.concatenate([on_face, corner_faces // 3])
        self._points = np.concatenate([points, vertices[corner_points]])
        self._tree = cKDTree(self._points)

    def closest(
        self, points: Float[np.ndarray, "point 3"], *, neighbours: int = 2
    ) -> tuple[Float[np.ndarray, "point 3"], Float[np.ndarray, "point"]]:
        """The nearest point of the surface, and the distance to it, for each point."""
        _, nearest = self._tree.query(points, k=neighbours)
        faces = self._faces[nearest].reshape(len(points), -1)
        repeated = np.repeat(points, faces.shape[1], axis=0)
        with np.errstate(all="ignore"):  # a triangle without area has no closest point; its sample stands for it
            candidates = trimesh.triangles.closest_point(self._triangles[faces.ravel()], repeated)
        samples = self._points[nearest.reshape(-1)]
        candidates = np.where(np.isfinite(candidates), candidates, samples).reshape(len(points), -1, 3)
        distances = np.linalg.norm(candidates - points[:, None], axis=2)
        best = np.argmin(distances, axis=1)
        rows = np.arange(len(points))
        return candidates[rows, best], distances[rows, best]
