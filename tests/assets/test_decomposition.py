"""Convex parts: few, small, true to the shape, and what they lose is measured."""

from dataclasses import replace

import manifold3d
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from clutter6d.assets.convex_part import hull_of, part_vertices, reduce_hull, reduce_vertices
from clutter6d.assets.decomposition import (
    MAX_PART_VERTICES,
    MAX_PARTS,
    DecompositionSettings,
    decompose,
    hausdorff_distance,
    merge_hulls,
)
from clutter6d.assets.given_parts import convex_hulls_of
from clutter6d.assets.solid import SolidSettings, close_solid
from clutter6d.errors import InvalidValueError
from tests.assets.mesh_files import arrays, as_mesh, l_bracket

SETTINGS = DecompositionSettings()
BOX = manifold3d.Manifold.cube((0.1, 0.2, 0.05), center=True)


def bracket() -> manifold3d.Manifold:
    return close_solid(*arrays(l_bracket()), SolidSettings()).manifold


def test_a_convex_solid_is_one_part() -> None:
    found = decompose(BOX, SETTINGS)
    assert len(found.parts) == 1
    assert len(found.parts[0].vertices) == 8
    assert found.volume_ratio == pytest.approx(1)
    assert found.hausdorff_m == pytest.approx(0, abs=1e-6)
    assert found.fallbacks == ()


def test_a_bracket_is_two_parts() -> None:
    found = decompose(bracket(), SETTINGS)
    assert len(found.parts) == 2
    assert found.volume_ratio == pytest.approx(1, abs=0.05)
    assert found.hausdorff_m < 0.005


def test_a_ring_keeps_its_hole_within_the_limits() -> None:
    ring = close_solid(*arrays(trimesh.creation.torus(0.05, 0.015)), SolidSettings()).manifold
    found = decompose(ring, SETTINGS)
    assert 4 <= len(found.parts) <= MAX_PARTS
    assert max(len(part.vertices) for part in found.parts) <= MAX_PART_VERTICES
    assert found.hausdorff_m < 0.012
    assert convex_hulls_of(found.parts) is not None


def test_the_same_solid_gives_the_same_parts() -> None:
    first, second = decompose(bracket(), SETTINGS), decompose(bracket(), SETTINGS)
    for one, other in zip(first.parts, second.parts, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)


@pytest.mark.parametrize("effort", ["coarse", "hull"])
def test_less_effort_is_on_record(effort: str) -> None:
    found = decompose(bracket(), SETTINGS, effort=effort)
    assert found.fallbacks == (f"decomposition:{effort}",)
    assert len(found.parts) == 1 if effort == "hull" else len(found.parts) >= 1


def test_limits_are_kept_even_if_the_shape_suffers() -> None:
    ring = close_solid(*arrays(trimesh.creation.torus(0.05, 0.01)), SolidSettings()).manifold
    found = decompose(ring, replace(SETTINGS, max_parts=3, max_part_vertices=10))
    assert len(found.parts) <= 3
    assert max(len(part.vertices) for part in found.parts) <= 10
    assert "decomposition:out-of-tolerance" in found.fallbacks


@pytest.mark.parametrize("changes", [{"max_parts": 0}, {"max_part_vertices": 3}])
def test_impossible_limits_are_refused(changes: dict[str, int]) -> None:
    with pytest.raises(InvalidValueError):
        DecompositionSettings(**changes)


def test_merging_takes_the_cheapest_pair_first() -> None:
    cubes = [manifold3d.Manifold.cube((1, 1, 1)).translate((x, 0, 0)) for x in (0, 1, 5)]
    merged = merge_hulls(cubes, max_parts=2, added_volume=0.0)
    assert sorted(round(hull.volume(), 6) for hull in merged) == [1, 2]


def test_hausdorff_distance_is_how_far_one_sticks_out() -> None:
    longer = manifold3d.Manifold.cube((0.1, 0.2, 0.07), center=True)
    assert hausdorff_distance(BOX, longer) == pytest.approx(0.01, abs=1e-4)
    assert hausdorff_distance(BOX, BOX) == 0


def test_cuts_between_touching_parts_do_not_count() -> None:
    halves = [
        manifold3d.Manifold.cube((0.05, 0.2, 0.05), center=True).translate((x, 0, 0)) for x in (-0.025, 0.0250001)
    ]
    assert hausdorff_distance(BOX, halves[0] + halves[1]) < 5e-4


@given(seed=st.integers(0, 500), count=st.integers(4, 120), limit=st.integers(6, 32))
def test_reduced_vertices_are_a_subset_within_the_limit(seed: int, count: int, limit: int) -> None:
    points = np.random.Generator(np.random.PCG64(seed)).normal(size=(count, 3))
    reduced = reduce_vertices(points, limit)
    assert len(reduced) <= limit
    assert {tuple(row) for row in reduced} <= {tuple(row) for row in points}


def test_a_reduced_ball_keeps_its_volume() -> None:
    ball = manifold3d.Manifold.sphere(0.1, 64)
    reduced = reduce_hull(part_vertices(ball), 32)
    assert reduced is not None
    assert reduced.num_vert() <= 32
    assert reduced.volume() == pytest.approx(ball.volume(), rel=0.02)


def test_flat_points_have_no_hull() -> None:
    assert hull_of(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.00001]])) is None


def test_given_parts_must_be_convex() -> None:
    assert convex_hulls_of([as_mesh(trimesh.creation.box((1, 1, 1)))]) is not None
    assert convex_hulls_of([as_mesh(l_bracket())]) is None
