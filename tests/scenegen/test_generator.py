"""Scenes: what is asked for is what is made, again and again."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from clutter6d.assets.library import AssetLibrary
from clutter6d.errors import GenerationError, InvalidValueError
from clutter6d.geometry import rotation_error_rad
from clutter6d.scene import TABLE, Relation, SceneGraph
from clutter6d.scene_file import scene_to_file
from clutter6d.scenegen.generation import generate_scenes, open_for_generation
from clutter6d.scenegen.generator import SceneGenerator
from clutter6d.scenegen.generator_config import GeneratorConfig
from clutter6d.scenegen.scene_set import SceneSet
from clutter6d.scenegen.track import Region, Track, find_track
from clutter6d.sim.contacts import find_contacts
from clutter6d.sim.scene_model import compile_stored_scene, joint_state


def test_one_scene_regenerates_alone_and_among_others(box_library: AssetLibrary, moderate_set: SceneSet) -> None:
    alone = SceneGenerator(box_library, find_track("moderate"), 0).generate(1).scene
    assert scene_to_file(alone) == scene_to_file(moderate_set.scenes[1])


def test_any_number_of_workers_makes_the_same_scenes(
    box_library: AssetLibrary, moderate_set: SceneSet, tmp_path: Path
) -> None:
    track = find_track("moderate")
    again = open_for_generation(box_library, track, 0, tmp_path / "two-workers")
    assert len(list(generate_scenes(box_library, track, 0, again, range(2), workers=2))) == 2
    assert SceneSet.open(again.path).sha256 == moderate_set.sha256


def test_another_seed_makes_another_scene(box_library: AssetLibrary, moderate_set: SceneSet) -> None:
    other = SceneGenerator(box_library, find_track("moderate"), 1).generate(0).scene
    assert not np.array_equal(other.goal_pairs[0].object_poses, moderate_set.scenes[0].goal_pairs[0].object_poses)


def test_a_scene_has_the_tracks_objects_and_goal_pairs(moderate_set: SceneSet) -> None:
    for scene in moderate_set.scenes:
        assert [item.role for item in scene.objects] == ["target", *["large"] * 3, *["small"] * 4]
        assert len(scene.goal_pairs) == 16
        assert len({item.asset_hash for item in scene.objects}) == 8


def test_targets_start_and_end_in_their_region_and_far_enough_apart(moderate_set: SceneSet) -> None:
    for scene in moderate_set.scenes:
        for pair in scene.goal_pairs:
            assert pair.planar_displacement_m >= 0.15
            for pose in (pair.initial, pair.goal):
                assert abs(pose.position[0]) <= 0.151
                assert abs(pose.position[1]) <= 0.301


def test_stored_poses_rest_in_stable_orientations_of_their_assets(moderate_set: SceneSet) -> None:
    for scene in moderate_set.scenes:
        stable = moderate_set.assets_of(scene)[scene.target.asset_hash].stable
        for pair in scene.goal_pairs:
            for pose, index in ((pair.initial, pair.initial_stable_index), (pair.goal, pair.goal_stable_index)):
                tilt = up_in_object(np.array(pose.quat_wxyz)) @ up_in_object(stable.quats_wxyz[index])
                assert tilt > np.cos(np.deg2rad(1))


def up_in_object(quat: np.ndarray) -> np.ndarray:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quat)
    return matrix[6:]


def test_the_certificate_holds_in_plain_mujoco(moderate_set: SceneSet) -> None:
    scene = moderate_set.scenes[0]
    model = compile_stored_scene(scene, moderate_set.assets_of(scene)).model
    for pair in scene.goal_pairs[:4]:
        data = mujoco.MjData(model)
        data.qpos[:] = joint_state(pair.object_poses)
        data.ctrl[:] = data.qpos[:7]
        mujoco.mj_step(model, data, 200)
        after = data.qpos[7:].reshape(-1, 7)
        assert np.linalg.norm(after[:, :3] - pair.object_poses[:, :3], axis=1).max() <= 1e-3
        assert rotation_error_rad(after[:, 3:], pair.object_poses[:, 3:]).max() <= np.deg2rad(1)


def test_the_arm_at_home_and_the_goal_touch_nothing_but_the_table(moderate_set: SceneSet) -> None:
    scene = moderate_set.scenes[0]
    model = compile_stored_scene(scene, moderate_set.assets_of(scene))
    for pair in scene.goal_pairs:
        at_goal = pair.object_poses.copy()
        at_goal[0] = pair.goal.as_row()
        for contact in find_contacts(model, joint_state(at_goal)):
            assert "world" in contact.bodies
            assert contact.penetration_m <= 1e-3


def test_a_given_graph_is_realised_stacks_included(box_library: AssetLibrary) -> None:
    track = Track(name="stack", large_obstacles=1, small_obstacles=2, goal_pairs=2)
    relations = [Relation(kind="on", subject=name, reference=TABLE) for name in ("target", "large_0", "small_1")]
    relations += [
        Relation(kind="on", subject="small_0", reference="large_0"),
        Relation(kind="left_of", subject="small_1", reference="large_0"),
    ]
    graph = SceneGraph(objects=("target", *track.obstacle_names), relations=tuple(relations))
    scene = SceneGenerator(box_library, track, 0, graph=graph).generate(0).scene
    names = [item.name for item in scene.objects]
    poses = scene.goal_pairs[0].object_poses
    carried, carrier, beside = (poses[names.index(name)] for name in ("small_0", "large_0", "small_1"))
    assert carried[2] > carrier[2]
    assert beside[1] > carrier[1]


def test_goals_can_be_asked_for_as_relations(box_library: AssetLibrary) -> None:
    near = Relation(kind="behind", subject="target", reference="large_0")
    track = Track(name="near-goal", large_obstacles=1, small_obstacles=1, goal_pairs=4, goal_relations=(near,))
    scene = SceneGenerator(box_library, track, 3).generate(0).scene
    for pair in scene.goal_pairs:
        assert pair.goal.position[0] > pair.object_poses[1, 0]


def test_an_impossible_track_is_given_up_with_its_reasons(box_library: AssetLibrary) -> None:
    cramped = Track(
        name="cramped", large_obstacles=6, small_obstacles=6, clutter_region=Region(x=(0.0, 0.1), y=(0.0, 0.1))
    )
    config = GeneratorConfig(max_attempts=3)
    with pytest.raises(GenerationError, match=r"no valid scene in 3 attempts .*no free placement 3"):
        SceneGenerator(box_library, cramped, 0, config=config).generate(0)


def test_a_library_that_is_too_small_is_refused_before_anything_is_written(
    tmp_path: Path, box_library: AssetLibrary
) -> None:
    small = AssetLibrary.create(tmp_path / "library")
    small.add(box_library.load(box_library.names()[0]))
    with pytest.raises(InvalidValueError, match="can be 'large', but a dense scene needs 5"):
        open_for_generation(small, find_track("dense"), 0, tmp_path / "scenes")
    assert not (tmp_path / "scenes").exists()
