"""Closing soups: exact for closed components, thin plates for open sheets, never a silent wrong volume."""

import manifold3d
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from clutter6d.assets.marching import march_tetrahedra
from clutter6d.assets.solid import ClosedSolid, SolidSettings, close_solid, simplify_solid
from clutter6d.errors import MeshRejectedError
from tests.assets.mesh_files import arrays, open_can

SETTINGS = SolidSettings()


def close(mesh: trimesh.Trimesh) -> ClosedSolid:
    return close_solid(*arrays(mesh), SETTINGS)


def test_marching_tetrahedra_bounds_a_ball() -> None:
    nodes = np.stack(np.meshgrid(*[np.arange(24.0)] * 3, indexing="ij"), axis=-1) - 11.5
    vertices, faces = march_tetrahedra(np.linalg.norm(nodes, axis=-1) - 8)
    ball = trimesh.Trimesh(vertices, faces, process=False)
    assert ball.is_watertight
    assert ball.is_winding_consistent
    assert ball.volume == pytest.approx(4 / 3 * np.pi * 8**3, rel=0.02)


@given(seed=st.integers(0, 1000))
def test_marching_tetrahedra_is_closed_whatever_the_field(seed: int) -> None:
    field = np.ones((6, 7, 5))
    field[1:-1, 1:-1, 1:-1] = np.random.Generator(np.random.PCG64(seed)).normal(size=(4, 5, 3))
    vertices, faces = march_tetrahedra(field)
    assert not len(faces) or trimesh.Trimesh(vertices, faces, process=False).is_watertight


@given(sides=st.tuples(*[st.floats(0.01, 0.5)] * 3))
def test_a_closed_box_keeps_its_volume(sides: tuple[float, float, float]) -> None:
    solid = close(trimesh.creation.box(sides))
    assert solid.was_watertight
    assert solid.manifold.volume() == pytest.approx(float(np.prod(sides)), rel=1e-3)


def test_an_inverted_box_is_turned_outward() -> None:
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    box.invert()
    assert close(box).manifold.volume() == pytest.approx(1e-3)


def test_overlapping_components_count_once() -> None:
    first = trimesh.creation.box((0.1, 0.1, 0.1))
    both = trimesh.util.concatenate([first, first.copy().apply_translation((0.05, 0, 0))])
    assert close(both).manifold.volume() == pytest.approx(1.5e-3)


def test_a_hole_is_bridged_by_wrapping() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.1)
    solid = close(trimesh.Trimesh(ball.vertices, ball.faces[3:], process=False))
    assert not solid.was_watertight
    assert solid.fallbacks == ("solid:wrapped",)
    assert solid.manifold.volume() == pytest.approx(ball.volume, rel=0.04)


def test_an_open_sheet_becomes_a_thin_plate() -> None:
    can = open_can()
    solid = close(can)
    assert solid.manifold.volume() == pytest.approx(can.area * SETTINGS.sheet_thickness_m, rel=0.15)


def test_loose_triangles_become_a_solid() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    soup = trimesh.Trimesh(
        ball.triangles.reshape(-1, 3) * 1.0, np.arange(len(ball.faces) * 3).reshape(-1, 3), process=False
    )
    soup.vertices += np.random.Generator(np.random.PCG64(0)).normal(scale=1e-4, size=soup.vertices.shape)
    assert close(soup).manifold.volume() == pytest.approx(ball.volume, rel=0.06)


def test_one_triangle_becomes_a_plate() -> None:
    triangle = trimesh.Trimesh([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], [[0, 1, 2]], process=False)
    assert close(triangle).manifold.volume() > 0


def test_faces_without_area_are_rejected() -> None:
    line = trimesh.Trimesh([[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]], [[0, 1, 2]], process=False)
    with pytest.raises(MeshRejectedError):
        close(line)


def test_simplifying_keeps_every_piece() -> None:
    large = manifold3d.Manifold.sphere(0.1, 96)
    both = large + manifold3d.Manifold.sphere(0.02, 96).translate((0.3, 0, 0))
    simpler = simplify_solid(both, 400)
    assert simpler.num_tri() < both.num_tri()
    assert len(simpler.decompose()) == 2
    assert simpler.volume() == pytest.approx(both.volume(), rel=0.1)
