"""One shape to one asset: size, frame, limits, determinism, and rejections."""

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from clutter6d.assets.asset import Asset
from clutter6d.assets.shape_preparation import draw_tabletop_size, simplify_visuals
from clutter6d.assets.sources.base import RawShape
from clutter6d.errors import MeshRejectedError
from tests.assets.conftest import process
from tests.assets.mesh_files import as_mesh, as_shape, l_bracket, open_can, source_object


def test_a_brick_is_what_it_is(brick: Asset) -> None:
    assert brick.extents_m == pytest.approx((0.12, 0.08, 0.04), abs=1e-6)
    assert len(brick.parts) == 1
    assert brick.quality.source_watertight
    assert brick.quality.fallbacks == ()
    assert len(brick.stable.heights_m) == 6
    assert len(brick.symmetry.discrete_quats_wxyz) == 4
    assert brick.size_class == "small"


def test_the_origin_is_the_centre_of_mass(bracket: Asset) -> None:
    corners = np.concatenate([item.mesh.vertices for item in bracket.visual]).astype(float)
    assert np.abs(corners.mean(axis=0)).max() > 1e-3
    mesh = trimesh.Trimesh(bracket.visual[0].mesh.vertices, bracket.visual[0].mesh.faces)
    np.testing.assert_allclose(mesh.center_mass, 0, atol=1e-4)


def test_inertia_is_that_of_the_solid(brick: Asset) -> None:
    mass = brick.mass_properties.mass_kg
    expected = mass / 12 * np.diag([0.08**2 + 0.04**2, 0.12**2 + 0.04**2, 0.12**2 + 0.08**2])
    np.testing.assert_allclose(brick.mass_properties.inertia, expected, rtol=1e-3, atol=1e-9)


def test_the_same_shape_gives_the_same_hash(bracket: Asset) -> None:
    assert process(as_shape(l_bracket()), name="bracket").content_hash == bracket.content_hash


def test_known_side_lengths_win_over_the_files_unit() -> None:
    asset = process(as_shape(trimesh.creation.box((12, 8, 4))), extents_m=(0.2, 0.1, 0.05))
    assert asset.extents_m == pytest.approx((0.2, 0.1, 0.05), abs=1e-6)


def test_an_unknown_unit_gets_a_tabletop_size() -> None:
    asset = process(as_shape(trimesh.creation.box((12, 8, 4))), is_metric=False)
    assert asset.longest_extent_m == pytest.approx(draw_tabletop_size(source_object(), seed=0), abs=1e-6)
    assert asset.size_class is not None


def test_tabletop_sizes_are_one_third_large() -> None:
    sizes = [draw_tabletop_size(source_object(f"thing-{index}"), seed=0) for index in range(600)]
    assert min(sizes) >= 0.06
    assert max(sizes) <= 0.35
    assert np.mean(np.array(sizes) >= 0.25) == pytest.approx(1 / 3, abs=0.06)


def test_a_flat_sheet_becomes_a_thin_asset() -> None:
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], process=False)
    asset = process(as_shape(sheet), extents_m=(0.14, 0.08, 0.001))
    assert len(asset.stable.heights_m) == 2
    assert asset.stable.heights_m.max() < 0.002


def test_an_open_vessel_keeps_its_hollow() -> None:
    asset = process(as_shape(open_can()))
    assert len(asset.parts) > 4
    assert "solid:wrapped" in asset.quality.fallbacks
    assert asset.quality.hull_volume_ratio < 0.6


def test_parts_known_from_construction_are_used() -> None:
    boxes = [
        trimesh.creation.box((0.1, 0.03, 0.02)),
        trimesh.creation.box((0.02, 0.03, 0.08)).apply_translation((0.04, 0, 0.05)),
    ]
    shape = replace(as_shape(*boxes), parts=tuple(as_mesh(box) for box in boxes))
    asset = process(shape)
    assert [len(part.vertices) for part in asset.parts] == [8, 8]
    assert asset.quality.fallbacks == ()


def test_given_parts_that_are_not_convex_are_made_anew() -> None:
    asset = process(replace(as_shape(l_bracket()), parts=(as_mesh(l_bracket()),)))
    assert len(asset.parts) == 2
    assert asset.quality.fallbacks[0] == "parts:given-not-convex-or-too-many"


def test_facts_of_construction_win_over_measurement() -> None:
    shape = as_shape(trimesh.creation.box((0.1, 0.1, 0.1)))
    known = replace(shape, volume_m3=2e-4, centre_of_mass_m=(0.0, 0.0, -0.02), inertia_per_kg=np.diag([3e-3] * 3))
    asset = process(known)
    assert asset.visual[0].mesh.vertices[:, 2].max() == pytest.approx(0.07, abs=1e-6)
    np.testing.assert_allclose(asset.mass_properties.inertia / asset.mass_properties.mass_kg, np.diag([3e-3] * 3))


def triangle_at(*corners: tuple[float, float, float]) -> RawShape:
    return as_shape(trimesh.Trimesh(corners, [[0, 1, 2]], process=False))


REJECTED = {
    "no triangle": (as_shape(trimesh.Trimesh(np.zeros((3, 3)), np.zeros((0, 3), int), process=False)), "empty"),
    "no mesh": (RawShape(visual=()), "empty"),
    "NaN": (triangle_at((0, 0, np.nan), (1, 0, 0), (0, 1, 0)), "not-finite"),
    "a point": (triangle_at((1, 1, 1), (1, 1, 1), (1, 1, 1)), "degenerate"),
    "a line": (triangle_at((0, 0, 0), (1, 0, 0), (2, 0, 0)), "degenerate"),
    "a kilometre": (as_shape(trimesh.creation.box((1000, 1, 1))), "implausible-size"),
    "a micrometre": (as_shape(trimesh.creation.box((1e-6, 1e-6, 1e-6))), "implausible-size"),
}


@pytest.mark.parametrize(("shape", "reason"), REJECTED.values(), ids=REJECTED.keys())
def test_what_cannot_become_an_asset_is_rejected_with_its_reason(shape: RawShape, reason: str) -> None:
    with pytest.raises(MeshRejectedError) as caught:
        process(shape)
    assert caught.value.reason == reason


def test_the_report_can_be_stored(bracket: Asset) -> None:
    assert json.dumps(bracket.quality.seconds)
    assert set(bracket.quality.seconds) == {
        "load", "solid", "decomposition", "mass", "visual", "attributes", "symmetry", "stable_poses",
    }  # fmt: skip


def test_simplified_visuals_keep_their_size() -> None:
    rng = np.random.Generator(np.random.PCG64(0))
    slivers = rng.random((3000, 3, 3)) * (1.0, 1e-4, 1e-7) + rng.random((3000, 1, 3))
    soup = trimesh.Trimesh(slivers.reshape(-1, 3), np.arange(9000).reshape(-1, 3), process=False)
    before = as_shape(soup).visual
    after = simplify_visuals(before, 200)
    grown = np.ptp(after[0].mesh.vertices, axis=0) / np.ptp(before[0].mesh.vertices, axis=0)
    assert grown.max() < 1.03
