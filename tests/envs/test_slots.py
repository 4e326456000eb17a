import mujoco
import numpy as np
import pytest

from clutter6d.envs.slots import ClutterSlots
from clutter6d.geometry import quat_to_matrix
from clutter6d.seeding import generator
from clutter6d.sim.robot import HOME_QPOS
from tests.scene_fixtures import make_box_scene

SHAPES = {
    "object_points": (512, 7),
    "environment_points": (512, 7),
    "end_effector_points": (256, 7),
    "hand_state": (9,),
    "joint_state": (14,),
    "relative_goal": (9,),
    "physics_parameters": (5,),
    "previous_action": (7,),
}


def make_env(slots: int, *, first: int = 0, threads: int = 1) -> ClutterSlots:
    """Slot i runs box scene ``first + i``, pair 1."""
    made = [make_box_scene(first + index) for index in range(slots)]
    env = ClutterSlots([model for _, model in made], threads=threads)
    env.load(np.arange(slots), [model for _, model in made], [scene.goal_pairs[1] for scene, _ in made])
    return env


def actions(slots: int, step: int) -> np.ndarray:
    return generator(0, "actions", step).uniform(-0.1, 0.1, size=(slots, 7)).astype(np.float32)


@pytest.fixture(scope="module")
def moved_env() -> ClutterSlots:
    env = make_env(20, threads=2)
    for step in range(5):
        env.step(np.arange(20), actions(20, step))
    return env


def test_observations_have_the_benchmarks_shapes(moved_env):
    observation = moved_env.observe()
    assert {name: value.shape[1:] for name, value in observation.items()} == SHAPES
    assert all(value.dtype == np.float32 and np.isfinite(value).all() for value in observation.values())


def test_some_slots_observe_what_all_slots_do(moved_env):
    everything, some = moved_env.observe(), moved_env.observe(np.array([3, 17]))
    for name, value in everything.items():
        assert np.array_equal(value[[3, 17]], some[name]), name


def test_hand_state_is_the_pose_of_the_hand_in_the_model(moved_env):
    observation = moved_env.observe()
    model = moved_env.batch.scenes[4].model
    data = mujoco.MjData(model)
    data.qpos[:7] = moved_env.batch.arm_qpos[4]
    mujoco.mj_kinematics(model, data)
    hand = data.body("hand")
    np.testing.assert_allclose(observation["hand_state"][4, :3], hand.xpos, atol=1e-6)
    matrix = hand.xmat.reshape(3, 3)
    np.testing.assert_allclose(observation["hand_state"][4, 3:], matrix[:, :2].T.ravel(), atol=1e-6)


def test_end_effector_points_move_as_the_arm_does(moved_env):
    env, step = make_env(1), 1e-4
    env.batch.arm_qvel[0] = generator(0, "qvel").normal(size=7)
    before = env.observe()["end_effector_points"].astype(np.float64)
    env.batch.arm_qpos[0] += step * env.batch.arm_qvel[0]
    after = env.observe()["end_effector_points"].astype(np.float64)
    np.testing.assert_allclose((after - before)[..., :3] / step, before[..., 4:], atol=0.02)
    np.testing.assert_allclose(before[..., 3].sum(), 0.6544 + 2 * 0.0291, rtol=1e-5)


def test_relative_goal_takes_the_targets_points_to_the_goal():
    env = make_env(1)
    points, relative = env.observe()["object_points"][0, :, :3], env.observe()["relative_goal"][0]
    first, second = relative[3:6], relative[6:]
    turn, centre = np.stack([first, second, np.cross(first, second)], axis=1), env.start_poses[0, 0, :3]
    there = (points - centre) @ turn.T + centre + relative[:3]
    canonical = (points - centre) @ quat_to_matrix(env.start_poses[0, 0, 3:])
    np.testing.assert_allclose(there, canonical @ quat_to_matrix(env.goals[0, 3:]).T + env.goals[0, :3], atol=1e-6)


def test_physics_parameters_are_the_targets_and_its_contacts():
    np.testing.assert_allclose(make_env(1).observe()["physics_parameters"][0], [0.3, 0.5, 1.0, 0.3, 0.0])


def test_previous_action_is_what_the_policy_asked_for():
    env = make_env(2)
    assert not env.observe()["previous_action"].any()
    asked = 3 * actions(2, 0)
    env.step(np.arange(2), asked)
    assert np.array_equal(env.observe()["previous_action"], asked)
    env.reset(np.array([1]))
    assert not env.observe()["previous_action"][1].any()


def test_a_slot_goes_the_same_way_alone_and_among_others_on_any_number_of_threads():
    many, alone = make_env(12, threads=2), make_env(1, first=7, threads=1)
    for step in range(6):
        chosen = actions(12, step)
        many.step(np.arange(12), chosen)
        alone.step(np.arange(1), chosen[7:8])
    assert np.array_equal(many.batch.states[7], alone.batch.states[0])
    together, single = many.observe(), alone.observe()
    for name, value in together.items():
        assert np.array_equal(value[7], single[name][0]), name
    assert many.reward().total[7] == alone.reward().total[0]


def test_only_the_named_slots_advance():
    env = make_env(3)
    before = env.batch.states.copy()
    env.step(np.array([1]), actions(1, 0))
    assert np.array_equal(env.batch.states[[0, 2]], before[[0, 2]])
    assert not np.array_equal(env.batch.states[1], before[1])


def test_an_episode_starts_from_the_stored_poses_at_rest(moved_env):
    env = make_env(2)
    env.step(np.arange(2), actions(2, 0))
    env.reset(np.arange(2))
    assert np.array_equal(env.batch.object_poses, env.start_poses)
    assert not env.batch.object_velocities.any()
    assert np.array_equal(env.batch.arm_qpos, np.tile(HOME_QPOS, (2, 1)))


def test_an_invalid_state_is_reported_and_forgotten_at_the_next_reset(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    env, slots = make_env(3), np.arange(3)
    env.batch.object_velocities[1, 0, 0] = 1e12
    assert env.step(slots, np.zeros((3, 7), np.float32)).tolist() == [False, True, False]
    assert not list(tmp_path.iterdir()), "the engine left its log behind"
    env.reset(np.array([1]))
    assert not env.step(slots, np.zeros((3, 7), np.float32)).any()


def test_a_stopped_arm_stays_where_it_is(moved_env):
    env = make_env(1)
    for step in range(3):
        env.step(np.arange(1), actions(1, step))
    env.stop_arm(np.arange(1))
    where = env.batch.arm_qpos.copy()
    for _ in range(10):
        env.advance(np.arange(1))
    np.testing.assert_allclose(env.batch.arm_qpos, where, atol=1e-3)
