"""Mass properties against formulas."""

import manifold3d
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from clutter6d.assets.mass_properties import integrate_manifold, integrate_solid, is_inertia, scale_inertia
from clutter6d.errors import MeshRejectedError
from tests.assets.mesh_files import arrays

SIDE = st.floats(0.01, 1.0)


@given(sides=st.tuples(SIDE, SIDE, SIDE), shift=st.tuples(*[st.floats(-1, 1)] * 3))
def test_a_box_has_the_textbook_inertia(sides: tuple[float, ...], shift: tuple[float, ...]) -> None:
    x, y, z = sides
    box = manifold3d.Manifold.cube(sides, center=True).translate(shift)
    volume, centre, inertia = integrate_manifold(box)
    assert volume == pytest.approx(x * y * z, rel=1e-9)
    np.testing.assert_allclose(centre, shift, atol=1e-9)
    np.testing.assert_allclose(inertia, np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) / 12, atol=1e-9)


def test_an_inverted_solid_is_rejected() -> None:
    vertices, faces = arrays(trimesh.creation.box((1, 1, 1)))
    with pytest.raises(MeshRejectedError, match="no-volume"):
        integrate_solid(vertices, faces[:, ::-1])


def test_the_triangle_inequality_of_moments_is_checked() -> None:
    assert is_inertia(np.diag([1.0, 1.0, 2.0]))
    assert not is_inertia(np.diag([1.0, 1.0, 2.1]))
    assert not is_inertia(np.diag([1.0, np.nan, 1.0]))


def test_tiny_bodies_get_an_inertia_that_simulates() -> None:
    assert np.linalg.eigvalsh(scale_inertia(np.diag([1e-9, 1e-9, 2e-9]), 0.01))[0] >= 1e-9
    np.testing.assert_array_equal(scale_inertia(np.eye(3), 2.0), 2 * np.eye(3))
