import mujoco
import numpy as np
import pytest

from clutter6d.envs.observation import BodyState
from clutter6d.envs.slots import ClutterSlots
from clutter6d.geometry import quat_to_matrix, transform_points
from clutter6d.seeding import generator
from clutter6d.sim.kinematics import hand_kinematics
from dapl_baselines.planners.hand_servo import tip_positions
from dapl_baselines.push_policy.push_state import POINTS, STATE_FIELDS, PushState, SceneFacts, read_push_state
from dapl_baselines.push_policy.tracker import POINTING_DOWN
from tests.scene_fixtures import make_box_scene

SLOTS = np.arange(2)


@pytest.fixture(scope="module")
def env() -> ClutterSlots:
    """Two scenes in motion."""
    made = [make_box_scene(index) for index in range(2)]
    env = ClutterSlots([model for _, model in made], threads=1)
    env.load(SLOTS, [model for _, model in made], [scene.goal_pairs[0] for scene, _ in made])
    rng = generator(0, "motion")
    env.batch.object_velocities[:] = rng.normal(size=(2, 4, 6))
    env.batch.object_poses[:, 0, 3:] = [0.5, 0.5, -0.5, 0.5]
    env.batch.arm_qvel[:] = rng.normal(size=(2, 7))
    return env


@pytest.fixture(scope="module")
def state(env) -> PushState[np.ndarray]:
    bodies = BodyState(
        arm_qpos=env.batch.arm_qpos,
        arm_qvel=env.batch.arm_qvel,
        object_poses=env.batch.object_poses,
        object_velocities=env.batch.object_velocities,
    )
    return read_push_state(bodies, hand_kinematics(env.batch.arm_qpos), SceneFacts.of(env.batch.scenes))


def test_velocities_are_in_world_axes_as_the_engine_has_them(env, state):
    for slot, scene in enumerate(env.batch.scenes):
        data = mujoco.MjData(scene.model)
        mujoco.mj_setState(scene.model, data, env.batch.states[slot], int(mujoco.mjtState.mjSTATE_INTEGRATION))
        mujoco.mj_forward(scene.model, data)
        velocity = np.zeros(6)
        body = scene.object_body_ids()[0]
        mujoco.mj_objectVelocity(scene.model, data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, 0)
        np.testing.assert_allclose(state.velocities[slot], [*velocity[3:], *velocity[:3]], atol=1e-9)


def test_obstacles_are_balls_that_hold_the_objects(env, state):
    for slot, scene in enumerate(env.batch.scenes):
        radii = [np.linalg.norm(asset.surface_points, axis=1).max() for asset in scene.assets[1:]]
        np.testing.assert_allclose(state.obstacles[slot, :, 3], radii)
        np.testing.assert_array_equal(state.obstacles[slot, :, :3], env.batch.object_poses[slot, 1:, :3])
        np.testing.assert_allclose(state.obstacles[slot, :, 4], scene.object_masses_kg()[1:])
        np.testing.assert_allclose(state.physics[slot], [0.3, 0.5])


def test_surfaces_are_placed_with_the_objects_and_leave_the_target_out(env):
    facts, poses = SceneFacts.of(env.batch.scenes), env.batch.object_poses
    placed = facts.placed_surfaces(poses).reshape(2, 3, POINTS, 3)
    for slot, scene in enumerate(env.batch.scenes):
        for number, asset in enumerate(scene.assets[1:]):
            here = transform_points(poses[slot, number + 1], asset.surface_points.astype(np.float64))
            for axis in range(3):
                np.testing.assert_allclose(placed[slot, number, :, axis].max(), here[:, axis].max(), atol=0.02)
                np.testing.assert_allclose(placed[slot, number, :, axis].min(), here[:, axis].min(), atol=0.02)


def test_the_tips_and_how_the_hand_is_held_and_moves(env, state):
    hand, step = hand_kinematics(env.batch.arm_qpos), 1e-6
    np.testing.assert_array_equal(state.tips, tip_positions(hand.pose))
    later = hand_kinematics(env.batch.arm_qpos + step * env.batch.arm_qvel)
    np.testing.assert_allclose(state.tip_velocities, (later.pose - hand.pose)[:, :3] / step, atol=1e-4)
    held = quat_to_matrix(state.hands) @ POINTING_DOWN
    np.testing.assert_allclose(held, quat_to_matrix(hand.pose[:, 3:]), atol=1e-9)


def test_what_was_read_does_not_move_on(env, state):
    before = {name: getattr(state, name).copy() for name in STATE_FIELDS}
    env.step(SLOTS, np.full((2, 7), 0.05, dtype=np.float32))
    assert all(np.array_equal(getattr(state, name), before[name]) for name in STATE_FIELDS)


def test_rows_are_copies(state):
    row = state.rows(np.array([1]))
    row.poses[:] = 0
    assert np.abs(state.poses[1]).max() > 0


def test_facts_of_some_slots_can_be_replaced(env):
    facts, other = SceneFacts.of(env.batch.scenes), SceneFacts.of(env.batch.scenes[:1])
    facts.put(np.array([1]), other)
    for name in ("radii", "masses", "frictions"):
        assert np.array_equal(getattr(facts, name)[1], getattr(other, name)[0])
