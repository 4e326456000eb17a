"""The canonical points of an asset: 512, uniform on the visual surface (paper, "Sampling and Filtering")."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32

from clutter6d.assets.asset import SURFACE_POINTS, VisualMesh
from clutter6d.assets.surface_distance import sample_surface


def sample_surface_points(
    visual: Sequence[VisualMesh], rng: np.random.Generator
) -> Float32[np.ndarray, f"{SURFACE_POINTS} 3"]:
    """Points drawn uniformly by area on all visual meshes together, in the object frame [m]."""
    starts = np.cumsum([0, *(len(item.mesh.vertices) for item in visual)])[:-1]
    vertices = np.concatenate([item.mesh.vertices for item in visual]).astype(np.float64)
    faces = np.concatenate([item.mesh.faces + start for item, start in zip(visual, starts, strict=True)])
    points, _ = sample_surface(vertices, faces, SURFACE_POINTS, rng)
    return points.astype(np.float32)
