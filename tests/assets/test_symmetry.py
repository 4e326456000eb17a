"""Symmetries of shapes whose symmetries are known."""

import numpy as np
import pytest
import trimesh

from clutter6d.assets.asset import SymmetryGroup
from clutter6d.assets.mass_properties import integrate_solid
from clutter6d.assets.symmetry import find_symmetries
from clutter6d.geometry import is_unit, rotate
from tests.assets.mesh_files import arrays, l_bracket


def symmetry_of(mesh: trimesh.Trimesh) -> SymmetryGroup:
    vertices, faces = arrays(mesh)
    _, centre, inertia = integrate_solid(vertices, faces)
    return find_symmetries(vertices - centre, faces, inertia)


SHAPES = {
    "a cylinder turns and flips": (trimesh.creation.cylinder(0.03, 0.1), 2, (0, 0, 1)),
    "a cone only turns": (trimesh.creation.cone(0.04, 0.1), 1, (0, 0, 1)),
    "a brick has three half turns": (trimesh.creation.box((0.2, 0.1, 0.05)), 4, None),
    "a square prism has eight": (trimesh.creation.box((0.05, 0.05, 0.12)), 8, None),
    "a cube has twenty-four": (trimesh.creation.box((0.1, 0.1, 0.1)), 24, None),
    "a bracket with one mirror plane has none": (l_bracket(), 1, None),
}


@pytest.mark.parametrize(("mesh", "rotations", "axis"), SHAPES.values(), ids=SHAPES.keys())
def test_known_symmetries_are_found(mesh: trimesh.Trimesh, rotations: int, axis: tuple[float, ...] | None) -> None:
    found = symmetry_of(mesh)
    assert len(found.discrete_quats_wxyz) == rotations
    assert is_unit(found.discrete_quats_wxyz).all()
    np.testing.assert_array_equal(found.discrete_quats_wxyz[0], (1, 0, 0, 0))
    assert (found.continuous_axis is None) == (axis is None)
    if axis is not None:
        assert abs(np.dot(found.continuous_axis, axis)) == pytest.approx(1, abs=1e-3)


def test_a_turned_prism_is_as_symmetric_as_an_upright_one() -> None:
    prism = trimesh.creation.box((0.05, 0.05, 0.12))
    prism.apply_transform(trimesh.transformations.rotation_matrix(0.7, (0.3, 0.9, 0.2)))
    assert len(symmetry_of(prism).discrete_quats_wxyz) == 8


def test_a_handle_breaks_the_turning_symmetry() -> None:
    body = trimesh.creation.cylinder(0.04, 0.1)
    handle = trimesh.creation.box((0.03, 0.012, 0.06)).apply_translation((0.05, 0, 0))
    assert symmetry_of(trimesh.boolean.union([body, handle])).continuous_axis is None


def test_rotating_by_a_symmetry_maps_corners_to_corners() -> None:
    box = trimesh.creation.box((0.2, 0.1, 0.05))
    for quat in symmetry_of(box).discrete_quats_wxyz:
        turned = rotate(quat, np.array(box.vertices))
        assert {tuple(row) for row in np.round(turned, 6) + 0.0} == {
            tuple(row) for row in np.round(box.vertices, 6) + 0.0
        }
