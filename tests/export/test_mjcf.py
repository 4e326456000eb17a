"""MJCF export: opens in plain MuJoCo, and is the same scene."""

import csv
from pathlib import Path

import mujoco
import numpy as np
import pytest

from clutter6d.export.mjcf import export_mjcf, scene_spec
from clutter6d.sim.scene_model import compile_stored_scene, joint_state
from tests.export.export_fixtures import crooked_scene
from tests.scene_fixtures import make_box_scene_set


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene_set = make_box_scene_set(1)
    return export_mjcf(scene_set.scenes[0], scene_set.assets, tmp_path_factory.mktemp("mjcf"))


def test_every_goal_pair_is_a_keyframe_with_its_ghost(exported: Path) -> None:
    scene = make_box_scene_set(1).scenes[0]
    model = mujoco.MjModel.from_xml_path(str(exported))
    data = mujoco.MjData(model)
    for number, pair in enumerate(scene.goal_pairs):
        mujoco.mj_resetDataKeyframe(model, data, model.key(f"pair_{number}").id)
        np.testing.assert_allclose(data.qpos, joint_state(pair.object_poses), atol=1e-15)
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(data.body("goal").xpos, pair.goal.position)


def test_the_exported_scene_moves_as_the_simulated_one(exported: Path) -> None:
    scene_set = make_box_scene_set(1)
    ours = compile_stored_scene(scene_set.scenes[0], scene_set.assets).model
    finals = []
    for model in (ours, mujoco.MjModel.from_xml_path(str(exported))):
        data = mujoco.MjData(model)
        data.qpos[:] = joint_state(scene_set.scenes[0].goal_pairs[0].object_poses)
        data.ctrl[:] = data.qpos[:7] + 0.1
        mujoco.mj_step(model, data, 200)
        finals.append(data.qpos.copy())
    np.testing.assert_allclose(*finals, atol=1e-6)


def test_masses_and_collision_geometry_are_the_assets(exported: Path) -> None:
    scene_set = make_box_scene_set(1)
    model = mujoco.MjModel.from_xml_path(str(exported))
    for item in scene_set.scenes[0].objects:
        asset = scene_set.assets[item.asset_hash]
        body = model.body(item.name)
        assert body.mass[0] == asset.mass_properties.mass_kg
        geoms = range(body.geomadr[0], body.geomadr[0] + body.geomnum[0])
        assert sum(model.geom_contype[geom] != 0 for geom in geoms) == len(asset.parts)


def test_numbers_come_back_to_the_bit(tmp_path: Path) -> None:
    scene, assets = crooked_scene()
    read = mujoco.MjModel.from_xml_path(str(export_mjcf(scene, assets, tmp_path)))
    made = scene_spec(scene, assets).compile()
    for name in (
        "body_mass",
        "body_inertia",
        "body_pos",
        "geom_size",
        "mesh_vert",
        "jnt_range",
        "key_qpos",
        "key_mpos",
    ):
        np.testing.assert_array_equal(getattr(read, name), getattr(made, name), err_msg=name)
    for name in ("body_quat", "body_iquat", "geom_quat"):  # normalised again when read
        np.testing.assert_allclose(getattr(read, name), getattr(made, name), atol=1e-15, err_msg=name)


def test_the_ghost_touches_nothing(exported: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(exported))
    body = model.body("goal")
    geoms = slice(body.geomadr[0], body.geomadr[0] + body.geomnum[0])
    assert not model.geom_contype[geoms].any()
    assert not model.geom_conaffinity[geoms].any()


def test_attribution_travels_with_every_object(exported: Path) -> None:
    rows = list(csv.DictReader((exported.parent / "LICENCES.csv").read_text().splitlines()))
    assert [row["object"] for row in rows] == ["target", "large_0", "small_0", "small_1"]
    assert {row["licence"] for row in rows} == {"Apache-2.0"}
