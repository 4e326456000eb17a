"""Procedural objects: solid, metric, convex in parts, repeatable to the bit, and as symmetric as they claim."""

from collections import Counter
from functools import cache
from importlib.metadata import entry_points

import manifold3d
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from clutter6d.assets.asset import LARGE_EXTENT_M, SMALL_EXTENT_M
from clutter6d.assets.sources.base import RawShape
from clutter6d.assets.sources.procedural import FAMILIES, ProceduralSource
from clutter6d.assets.sources.procedural.design import Design, Piece
from clutter6d.assets.sources.procedural.outline import polygon_outline
from clutter6d.assets.sources.procedural.palette import COLOURS, MATERIALS
from clutter6d.assets.sources.procedural.primitives import MAX_PART_VERTICES, bar, box, cup, disc, lathe, open_box, ring
from clutter6d.assets.sources.procedural.solid import Solid
from clutter6d.assets.sources.procedural.source import design_of
from clutter6d.assets.sources.procedural.symmetry import ASYMMETRIC, BOX, CUBE, TURNED, prism
from clutter6d.assets.surface_distance import SurfaceDistance, sample_surface
from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.geometry import quat_from_axis_angle, rotate
from clutter6d.seeding import generator

MAX_PARTS = 16
FAMILY_NAMES = tuple(FAMILIES)


@cache
def shape_of(family: str, index: int) -> RawShape:
    return FAMILIES[family].design(0, index).shape()


def corners_of(shape: RawShape) -> np.ndarray:
    return np.concatenate([item.mesh.vertices for item in shape.visual]).astype(float)


def manifold_of(vertices: np.ndarray, faces: np.ndarray) -> manifold3d.Manifold:
    solid = manifold3d.Manifold(manifold3d.Mesh64(vertices.astype(float), faces.astype(np.uint64)))
    assert solid.status() == manifold3d.Error.NoError
    return solid


def union_of_parts(shape: RawShape) -> manifold3d.Manifold:
    solids = [manifold_of(part.vertices, part.faces) for part in shape.parts or ()]
    return manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)


def union_of_shells(design: Design) -> manifold3d.Manifold:
    shells = [shell for piece in design.pieces for shell in piece.solid.shells]
    solids = [manifold_of(np.round(shell.vertices, 6), shell.faces) for shell in shells]
    return manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)


def surface_of(solid: manifold3d.Manifold) -> tuple[np.ndarray, np.ndarray]:
    mesh = solid.to_mesh64()
    return np.asarray(mesh.vert_properties[:, :3]), np.asarray(mesh.tri_verts).astype(np.int32)


def test_there_are_dozens_of_families_with_both_size_classes():
    assert len(FAMILIES) >= 36
    assert sum(family.large is not None for family in FAMILIES.values()) >= 12
    assert sum(family.small is not None for family in FAMILIES.values()) >= 24


@pytest.mark.parametrize("family", FAMILY_NAMES)
def test_parts_are_few_and_convex(family: str):
    for index in range(2):
        shape = shape_of(family, index)
        assert shape.parts is not None
        assert 1 <= len(shape.parts) <= MAX_PARTS
        for part in shape.parts:
            assert 4 <= len(part.vertices) <= MAX_PART_VERTICES
            volume = manifold_of(part.vertices, part.faces).volume()
            assert volume > 0
            assert volume == pytest.approx(ConvexHull(part.vertices).volume, rel=1e-3, abs=1e-12)


@pytest.mark.parametrize("family", FAMILY_NAMES)
def test_parts_fill_what_is_seen(family: str):
    design, shape = FAMILIES[family].design(0, 0), shape_of(family, 0)
    felt, seen = union_of_parts(shape), union_of_shells(design)
    assert shape.volume_m3 == pytest.approx(seen.volume(), rel=1e-6)
    assert felt.volume() == pytest.approx(seen.volume(), rel=0.11)
    tolerance_m = 0.065 * design.longest_m
    for surface, other in ((felt, seen), (seen, felt)):
        points, _ = sample_surface(*surface_of(surface), 600, generator(0, "test"))
        assert SurfaceDistance(*surface_of(other), samples=20_000).closest(points, neighbours=16)[1].max() < tolerance_m


@pytest.mark.parametrize("family", FAMILY_NAMES)
def test_the_visible_surface_alone_encloses_the_volume(family: str):
    shape = shape_of(family, 1)
    corners = np.concatenate([item.mesh.vertices[item.mesh.faces] for item in shape.visual]).astype(float)
    enclosed = np.linalg.det(corners).sum() / 6
    assert enclosed == pytest.approx(shape.volume_m3, rel=1e-3)


@pytest.mark.parametrize("family", FAMILY_NAMES)
def test_sizes_are_of_the_size_class(family: str):
    for index in range(4):
        shape_m = FAMILIES[family].design(0, index).longest_m
        assert SMALL_EXTENT_M[0] <= shape_m <= LARGE_EXTENT_M[1]


@pytest.mark.parametrize("family", FAMILY_NAMES)
def test_mass_is_balanced_within_the_object(family: str):
    design = FAMILIES[family].design(0, 1)
    shape, balance = design.shape(), design.balance()
    low, high = corners_of(shape).min(axis=0), corners_of(shape).max(axis=0)
    assert 0.02 <= balance.mass_kg <= 3.0
    assert (low < balance.centre_m).all()
    assert (balance.centre_m < high).all()
    principal = np.linalg.eigvalsh(balance.inertia_per_kg)
    assert principal[0] > 0
    assert principal[2] <= principal[0] + principal[1]
    assert principal[2] < np.square(high - low).sum()


@pytest.mark.parametrize("family", FAMILY_NAMES)
def test_declared_symmetries_leave_the_shape_unchanged(family: str):
    shape = shape_of(family, 0)
    assert shape.symmetry is not None
    rotations = list(shape.symmetry.discrete_quats_wxyz)
    if shape.symmetry.continuous_axis is not None:
        axis = np.array(shape.symmetry.continuous_axis)
        rotations += [quat_from_axis_angle(axis, angle) for angle in (0.4, 1.9, 3.3)]
    np.testing.assert_allclose(rotations[0], [1, 0, 0, 0], atol=1e-12)
    vertices, faces = surface_of(union_of_shells(FAMILIES[family].design(0, 0)))
    centred = vertices - np.array(shape.centre_of_mass_m)
    surface = SurfaceDistance(centred, faces, samples=20_000)
    stride = 1 + len(centred) // 300
    for quat in rotations[1:]:
        _, distance = surface.closest(rotate(quat, centred[::stride]), neighbours=16)
        assert distance.max() < 0.012 * np.ptp(centred, axis=0).max() + 0.0006


def test_one_key_gives_one_shape_alone_or_among_others():
    many = ProceduralSource(seed=3, count=len(FAMILIES) + 5)
    item = many.objects()[-1]
    alone = ProceduralSource(seed=99, count=1)
    first, second = many.load(item), alone.load(item)
    for a, b in zip(
        (*first.parts, *(v.mesh for v in first.visual)), (*second.parts, *(v.mesh for v in second.visual)), strict=True
    ):
        assert a.vertices.tobytes() == b.vertices.tobytes()
        assert a.faces.tobytes() == b.faces.tobytes()
    assert first.volume_m3 == second.volume_m3
    assert first.inertia_per_kg.tobytes() == second.inertia_per_kg.tobytes()


def test_vertices_lie_on_the_micrometre_grid():
    shape = shape_of("mug", 0)
    for mesh in (*shape.parts, *(item.mesh for item in shape.visual)):
        exact = np.round(mesh.vertices.astype(float), 6).astype(np.float32)
        assert (exact == mesh.vertices).all()


def test_seeds_and_indices_differ():
    masses = {design_of(f"v1/mug/{index:04d}/seed{seed}").balance().mass_kg for index in range(3) for seed in range(3)}
    assert len(masses) == 9


def test_a_smaller_count_is_the_beginning_of_a_larger_one():
    assert ProceduralSource(count=20).objects() == ProceduralSource(count=50).objects()[:20]


def test_objects_are_balanced_over_families_and_sizes():
    items = ProceduralSource(count=3 * len(FAMILIES)).objects()
    assert set(Counter(item.hints.category for item in items).values()) == {3}
    assert len({item.name for item in items}) == len(items)
    sizes = np.array([design_of(item.key).longest_m for item in items])
    assert 0.3 < (sizes >= LARGE_EXTENT_M[0]).mean() < 0.5
    assert ((sizes >= 0.07) & (sizes <= 0.2)).mean() > 0.35


def test_the_listing_states_what_an_object_is():
    item = ProceduralSource(families=["hammer"], count=1).objects()[0]
    assert item.key == "v1/hammer/0000/seed0"
    assert item.name == "hammer-0000"
    assert item.licence.name == "Apache-2.0"
    assert item.hints.category == "hammer"
    assert item.hints.material in MATERIALS
    assert item.hints.colour in COLOURS
    assert 0.1 < item.hints.mass_kg < 1.5
    assert 0.3 <= item.hints.friction <= 0.9


def test_the_fingerprint_tells_objects_apart():
    source = ProceduralSource(count=5)
    assert len({source.fingerprint(item) for item in source.objects()}) == 5


def test_it_is_registered_as_an_asset_source():
    (entry,) = entry_points(group="clutter6d.asset_sources", name="procedural")
    assert entry.load() is ProceduralSource


@pytest.mark.parametrize("key", ["mug", "v1/mug/0001", "v0/mug/0001/seed0", "v1/mug/0001/seed-1", "v1/mug/1/seed0"])
def test_a_wrong_key_is_refused(key: str):
    with pytest.raises(InvalidValueError, match="is not of the form"):
        design_of(key)


def test_wrong_arguments_are_refused():
    with pytest.raises(UnknownNameError, match="did you mean 'mug'"):
        ProceduralSource(families=["mugg"])
    with pytest.raises(InvalidValueError, match="must not be negative"):
        ProceduralSource(count=-1)
    with pytest.raises(InvalidValueError, match="empty"):
        ProceduralSource(families=[])


PRIMITIVES = {
    "box": (box(0.1, 0.06, 0.04), 0.1 * 0.06 * 0.04),
    "disc": (disc(0.05, 0.1), np.pi * 0.05**2 * 0.1),
    "cone": (lathe([(0.05, 0), (0.0001, 0.09)]), np.pi * 0.05**2 * 0.09 / 3),
    "ring": (ring(0.05, 0.03, 0.02), np.pi * (0.05**2 - 0.03**2) * 0.02),
    "nut": (ring(0.05, 0.02, 0.02, outline=polygon_outline(6)), (1.5 * 3**0.5 * 0.05**2 - np.pi * 0.02**2) * 0.02),
    "cup": (cup([(0.05, 0), (0.05, 0.1)], wall=0.005, floor=0.01), np.pi * (0.05**2 * 0.1 - 0.045**2 * 0.09)),
    "rod": (bar([(0, 0, 0), (0.1, 0, 0), (0.2, 0, 0)], 0.02), np.pi * 0.01**2 * 0.2),
    "crate": (open_box(0.2, 0.1, 0.08, 0.005), 0.2 * 0.1 * 0.08 - 0.19 * 0.09 * 0.075),
}


@pytest.mark.parametrize("name", PRIMITIVES)
def test_primitives_have_their_textbook_volume(name: str):
    solid, volume_m3 = PRIMITIVES[name]
    shape = Design((Piece(solid, "wood", "oak"),)).shape()
    assert shape.volume_m3 == pytest.approx(volume_m3, rel=0.02)
    assert union_of_parts(shape).volume() == pytest.approx(volume_m3, rel=0.02)


def test_a_box_has_the_textbook_mass_and_inertia():
    balance = Design((Piece(box(0.2, 0.1, 0.05, rounding=1e-5).at(1, 2, 3), "wood", "oak"),)).balance()
    assert balance.mass_kg == pytest.approx(650 * 0.2 * 0.1 * 0.05, rel=1e-3)
    np.testing.assert_allclose(balance.centre_m, (1, 2, 3.025), atol=1e-6)
    expected = np.diag([0.1**2 + 0.05**2, 0.2**2 + 0.05**2, 0.2**2 + 0.1**2]) / 12
    np.testing.assert_allclose(balance.inertia_per_kg, expected, atol=1e-6)


def test_mirroring_keeps_surfaces_outward():
    wedge = lathe([(0.05, 0), (0.02, 0.1)]).at(x=0.3)
    assert _volume(wedge.stretch(x=-1)) == pytest.approx(_volume(wedge), rel=1e-4)
    assert _volume(wedge.turn("y", 37).turn("z", -80)) == pytest.approx(_volume(wedge), rel=1e-4)


def _volume(solid: Solid) -> float:
    return Design((Piece(solid, "wood", "oak"),)).shape().volume_m3 or 0.0


def test_what_is_only_seen_has_no_parts():
    assert disc(0.02, 0.001).seen_only().parts == ()


def test_a_design_weighs_what_it_may():
    design = Design((Piece(box(0.1, 0.1, 0.1), "steel", "steel"),))
    own_kg = design.balance().mass_kg
    assert design.weighing(0.02, 2.0).balance().mass_kg == pytest.approx(2.0)
    assert design.weighing(10.0, 20.0).balance().mass_kg == pytest.approx(10.0)
    assert design.weighing(0.02, 20.0).balance().mass_kg == own_kg


@pytest.mark.parametrize(("symmetry", "order"), [(ASYMMETRIC, 1), (BOX, 4), (CUBE, 24), (prism(6), 12), (TURNED, 1)])
def test_symmetry_groups_are_complete(symmetry, order: int):
    assert len(symmetry.group().discrete_quats_wxyz) == order
