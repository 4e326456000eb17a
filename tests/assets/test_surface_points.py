"""512 points, uniform on the visual surface."""

import numpy as np
import trimesh

from clutter6d.assets.asset import VisualMesh
from clutter6d.assets.surface_distance import SurfaceDistance
from clutter6d.assets.surface_points import sample_surface_points
from clutter6d.seeding import generator
from tests.assets.mesh_files import GREY, arrays, as_mesh

BALL = trimesh.creation.icosphere(subdivisions=3, radius=0.1)
SMALL = trimesh.creation.icosphere(subdivisions=3, radius=0.05).apply_translation((1, 0, 0))


def test_points_lie_on_the_surface() -> None:
    points = sample_surface_points([VisualMesh(mesh=as_mesh(BALL), rgba=GREY)], generator(0))
    assert points.shape == (512, 3)
    _, distance = SurfaceDistance(*arrays(BALL)).closest(points.astype(float), neighbours=12)
    assert np.quantile(distance, 0.9) < 1e-6
    assert distance.max() < np.sqrt(BALL.area / 20_000)


def test_points_are_shared_by_area() -> None:
    visual = [VisualMesh(mesh=as_mesh(mesh), rgba=GREY) for mesh in (BALL, SMALL)]
    points = sample_surface_points(visual, generator(0))
    assert abs(np.mean(points[:, 0] > 0.5) - 0.2) < 0.05


def test_points_depend_on_the_generator_alone() -> None:
    visual = [VisualMesh(mesh=as_mesh(BALL), rgba=GREY)]
    first, second, other = (sample_surface_points(visual, generator(0, key)) for key in ("a", "a", "b"))
    np.testing.assert_array_equal(first, second)
    assert not np.array_equal(first, other)


def test_distances_to_a_box_are_exact() -> None:
    surface = SurfaceDistance(*arrays(trimesh.creation.box((2, 2, 2))))
    points = np.array([[2.0, 0, 0], [2, 2, 1], [0, 0, 0.25]])
    nearest, distance = surface.closest(points, neighbours=4)
    np.testing.assert_allclose(distance, [1, np.sqrt(2), 0.75], atol=1e-3)
    np.testing.assert_allclose(nearest[0], (1, 0, 0), atol=1e-9)
