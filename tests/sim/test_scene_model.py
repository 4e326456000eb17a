"""Scene models: one layout for all scenes of a track, and nothing of it can be felt in the physics."""

import dataclasses

import mujoco
import numpy as np
import pytest

from clutter6d.errors import InvalidValueError
from clutter6d.sim.batch import SceneBatch
from clutter6d.sim.scene_model import build_scene_spec, compile_scene, joint_state, motion_in_states
from tests.scene_fixtures import make_box_asset, make_box_scene

LAYOUT = ("nq", "nv", "nu", "na", "nbody", "njnt", "ngeom", "nsite", "nbvh", "narena", "nmocap", "ntree")


def box_objects(count: int, parts: int = 1) -> list:
    boxes = [make_box_asset(f"box-{index}", (0.1, 0.08, 0.06 + 0.01 * index)) for index in range(count)]
    return [(f"o{index}", dataclasses.replace(box, parts=box.parts * parts)) for index, box in enumerate(boxes)]


@pytest.mark.parametrize("objects", [4, 8, 12])
def test_scenes_of_one_track_share_a_layout_whatever_their_parts(objects: int) -> None:
    plain, rich = (compile_scene(box_objects(objects, parts)).model for parts in (1, 16))
    assert {name: getattr(plain, name) for name in LAYOUT} == {name: getattr(rich, name) for name in LAYOUT}


def test_an_asset_with_too_many_parts_is_refused() -> None:
    with pytest.raises(InvalidValueError, match=r"has 17 parts .* a scene allows 16 of 32"):
        compile_scene(box_objects(4, parts=17))


def test_a_padded_scene_moves_as_the_unpadded_one() -> None:
    scene, model = make_box_scene()
    objects = list(zip(model.names, model.assets, strict=True))
    states = []
    for built in (model.model, build_scene_spec(objects).compile()):
        data = mujoco.MjData(built)
        data.qpos[:] = joint_state(scene.goal_pairs[0].object_poses)
        data.ctrl[:] = data.qpos[:7] + 0.05
        mujoco.mj_step(built, data, 100)
        states.append(data.qpos.copy())
    np.testing.assert_array_equal(*states)


def test_qpos_is_the_arm_and_then_the_objects_in_order() -> None:
    scene, model = make_box_scene()
    qpos = joint_state(scene.goal_pairs[0].object_poses)
    data = mujoco.MjData(model.model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model.model, data)
    np.testing.assert_allclose(data.xpos[model.object_body_ids()], scene.goal_pairs[0].object_poses[:, :3])


def test_positions_and_velocities_in_a_state_are_those_that_the_engine_takes_from_it() -> None:
    _, scene = make_box_scene()
    whole = mujoco.mjtState.mjSTATE_INTEGRATION
    states = np.arange(2.0 * mujoco.mj_stateSize(scene.model, int(whole))).reshape(2, -1)
    found = motion_in_states(states, scene.object_count)
    for values, part in zip(found, (mujoco.mjtState.mjSTATE_QPOS, mujoco.mjtState.mjSTATE_QVEL), strict=True):
        for row, state in zip(values, states, strict=True):
            expected = np.zeros(mujoco.mj_stateSize(scene.model, int(part)))
            mujoco.mj_extractState(scene.model, state, int(whole), expected, int(part))
            np.testing.assert_array_equal(row, expected)


def test_a_batch_of_different_scenes_equals_each_scene_alone_on_any_number_of_threads() -> None:
    made = [make_box_scene(index) for index in range(3)]
    poses = np.stack([scene.goal_pairs[0].object_poses for scene, _ in made])
    final = []
    for threads in (1, 2):
        batch = SceneBatch([model for _, model in made], threads=threads)
        batch.reset(np.arange(3), poses)
        batch.joint_targets[:] += 0.3
        batch.step(physics_steps=100)
        final.append(batch.object_poses.copy())
    np.testing.assert_array_equal(*final)
    alone = SceneBatch([made[2][1]], threads=1)
    alone.reset(np.arange(1), poses[2:])
    alone.joint_targets[:] += 0.3
    alone.step(physics_steps=100)
    np.testing.assert_array_equal(alone.object_poses[0], final[0][2])


def test_a_slot_given_another_scene_runs_that_scene() -> None:
    (first, first_model), (second, second_model) = make_box_scene(0), make_box_scene(1)
    batch = SceneBatch([first_model, first_model], threads=1)
    batch.load(np.array([1]), [second_model])
    batch.reset(np.array([0, 1]), np.stack([first.goal_pairs[0].object_poses, second.goal_pairs[0].object_poses]))
    batch.joint_targets[:] += 0.3
    batch.step(physics_steps=50)
    alone = SceneBatch([second_model], threads=1)
    alone.reset(np.array([0]), second.goal_pairs[0].object_poses[None])
    alone.joint_targets[:] += 0.3
    alone.step(physics_steps=50)
    np.testing.assert_array_equal(batch.object_poses[1], alone.object_poses[0])


def test_scenes_of_different_tracks_do_not_mix() -> None:
    with pytest.raises(InvalidValueError, match="same number of objects"):
        SceneBatch([make_box_scene()[1], compile_scene(box_objects(8))])
