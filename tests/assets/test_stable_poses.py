"""Resting orientations hold in simulation, at the height where they rest."""

import mujoco
import numpy as np
import pytest
import trimesh

from clutter6d.assets.asset import Asset
from clutter6d.assets.mujoco_body import add_asset_body
from clutter6d.assets.stable_poses import StablePoseSettings, drop_test, propose_orientations, upright
from clutter6d.geometry import rotate, rotation_error_rad
from clutter6d.physics import add_table, apply_physics_options
from tests.assets.conftest import process
from tests.assets.mesh_files import as_shape

SETTINGS = StablePoseSettings()


def test_a_brick_rests_on_its_six_sides(brick: Asset) -> None:
    np.testing.assert_allclose(sorted(brick.stable.heights_m), [0.02, 0.02, 0.04, 0.04, 0.06, 0.06], atol=5e-4)
    assert brick.stable.probabilities.sum() == pytest.approx(1)
    assert (np.diff(brick.stable.probabilities) <= 1e-12).all()


def test_the_flattest_side_is_the_likeliest(brick: Asset) -> None:
    assert brick.stable.heights_m[0] == pytest.approx(0.02, abs=5e-4)


@pytest.mark.parametrize("name", ["brick", "bracket"])
def test_every_stored_orientation_holds_in_plain_mujoco(name: str, request: pytest.FixtureRequest) -> None:
    asset: Asset = request.getfixturevalue(name)
    spec = mujoco.MjSpec()
    apply_physics_options(spec)
    add_table(spec, (1.0, 1.0))
    add_asset_body(spec, asset, name="object")
    model = spec.compile()
    for quat, height in zip(asset.stable.quats_wxyz, asset.stable.heights_m, strict=True):
        data = mujoco.MjData(model)
        data.qpos[:] = (0, 0, height, *quat)
        for _ in range(200):
            mujoco.mj_step(model, data)
        assert np.linalg.norm(data.qpos[:3] - (0, 0, height)) <= 1e-3
        assert rotation_error_rad(data.qpos[3:] / np.linalg.norm(data.qpos[3:]), quat) <= np.deg2rad(1)


def test_a_pencil_does_not_stand_on_its_tip() -> None:
    pencil = trimesh.util.concatenate(
        [
            trimesh.creation.cylinder(0.004, 0.14, sections=6),
            trimesh.creation.cone(0.004, 0.01).apply_translation((0, 0, 0.07)),
        ]
    )
    asset = process(as_shape(pencil))
    up = rotate(asset.stable.quats_wxyz, np.array([0.0, 0.0, 1.0]))[:, 2]
    assert np.abs(up).max() < 0.2


def test_an_orientation_that_tips_over_is_dropped(brick: Asset) -> None:
    vertices = np.concatenate([part.vertices for part in brick.parts]).astype(float)
    on_edge = np.array([[np.cos(0.5), np.sin(0.5), 0, 0]])
    settled, held = drop_test(brick, on_edge, vertices, SETTINGS)
    assert held[0]
    assert rotation_error_rad(settled[0, 3:], on_edge[0]) > 0.3


def test_a_centre_of_mass_outside_the_hull_does_not_hang() -> None:
    corners = np.array(trimesh.creation.box((0.1, 0.1, 0.1)).vertices) + 5
    quats, _, fallbacks = propose_orientations(corners, SETTINGS)
    assert "stable-poses:hull-centre" in fallbacks
    assert len(quats) == 6


def test_no_more_than_sixty_four_are_kept() -> None:
    ball = process(as_shape(trimesh.creation.icosphere(subdivisions=3, radius=0.05)))
    assert 1 <= len(ball.stable.heights_m) <= 64


def test_upright_turns_every_direction_to_the_vertical_even_upside_down() -> None:
    ups = np.array([[0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0], [0.6, 0, -0.8], [4e-5, 0, -1.0]])
    turned = rotate(upright(ups), ups)
    np.testing.assert_allclose(turned, [[0, 0, 1]] * len(ups), atol=1e-4)


def test_proposals_do_not_depend_on_what_differs_between_processors() -> None:
    corners = trimesh.creation.box((0.08, 0.06, 0.04)).vertices
    plain, _, _ = propose_orientations(corners, SETTINGS)
    noisy, _, _ = propose_orientations(corners * (1 + 1e-15), SETTINGS)
    np.testing.assert_array_equal(plain, noisy)
