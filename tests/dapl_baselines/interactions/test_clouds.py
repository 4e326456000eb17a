"""Clouds rebuilt from states against what the environment shows."""

import numpy as np
import pytest

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.slots import ClutterSlots
from clutter6d.sim.kinematics import hand_pose
from dapl_baselines.interactions.dataset import MOVING_M, open_interactions
from tests.scene_fixtures import make_box_scene


@pytest.fixture(scope="module")
def data(pushed_boxes):
    return open_interactions([pushed_boxes])


def test_clouds_are_the_observations_to_the_bit(data):
    rows = data.training[np.array([3, 30, 60])]
    now, _ = data.states(rows)
    made = data.clouds(rows).now
    for index, scene in enumerate((0, 0, 1)):
        env = ClutterSlots([make_box_scene(scene)[1]], EnvConfig(), threads=1)
        env.load(np.zeros(1, int), [make_box_scene(scene)[1]], [make_box_scene(scene)[0].goal_pairs[0]])
        env.batch.arm_qpos[0], env.batch.arm_qvel[0] = now.arm_qpos[index], now.arm_qvel[index]
        env.batch.object_poses[0], env.batch.object_velocities[0] = (
            now.object_poses[index],
            now.object_velocities[index],
        )
        seen = env.observe()
        points = [seen[name][0] for name in ("object_points", "environment_points", "end_effector_points")]
        np.testing.assert_array_equal(made[index], np.concatenate(points))


def test_later_points_are_the_same_points_moved(data):
    """Within rigid bodies distances stay, and a point of a body at rest stays to the bit."""
    pairs = data.clouds(data.training)
    for part in (slice(0, 512), slice(1024, 1280)):
        before, after = (cloud[:, part, :3] for cloud in (pairs.now, pairs.later))
        distances = [np.linalg.norm(each[:, 1:] - each[:, :-1], axis=-1) for each in (before, after)]
        np.testing.assert_allclose(distances[0], distances[1], atol=1e-6)
    np.testing.assert_array_equal(pairs.now[..., 3], pairs.later[..., 3])


def test_points_that_move_are_in_transitions_that_say_so(data):
    pairs = data.clouds(data.training)
    moves = np.linalg.norm(pairs.later[:, :1024, :3] - pairs.now[:, :1024, :3], axis=-1)
    is_seen_moving = (moves > MOVING_M).any(axis=1)
    assert is_seen_moving.any()
    assert data.training.is_moving[is_seen_moving].all()


def test_flow_is_how_far_the_hand_moves(data):
    """Without rotation it would be the displacement of the hand's frame; the points are at most 15 cm from it."""
    now, later = data.states(data.training)
    frames = hand_pose(later.arm_qpos)[:, :3] - hand_pose(now.arm_qpos)[:, :3]
    flow = data.clouds(data.training).flow
    assert np.abs(flow - frames).max() < 0.03
    assert np.corrcoef(flow.ravel(), frames.ravel())[0, 1] > 0.9


def test_velocities_tell_where_points_go(data):
    """The mean of both velocities, times 0.1 s, explains most of how the hand's points move."""
    pairs = data.clouds(data.training)
    moved = (pairs.later - pairs.now)[:, 1024:, :3]
    expected = 0.05 * (pairs.now + pairs.later)[:, 1024:, 4:]
    assert np.abs(moved - expected).mean() < 0.4 * np.abs(moved).mean()


def test_a_turned_world_is_the_same_world_turned(data):
    rows = data.training[np.arange(0, 60, 20)]
    plain, turned = data.clouds(rows), data.clouds(rows, yaw_rad=np.full(3, np.pi / 2))
    for before, after in ((plain.now, turned.now), (plain.later, turned.later)):
        for first in (0, 4):
            x, y, z = (after[..., first + axis] for axis in range(3))
            expected = before[..., first : first + 3]
            np.testing.assert_allclose(np.stack([y, -x, z], axis=-1), expected, atol=1e-5)
    np.testing.assert_allclose(turned.flow[:, 1], plain.flow[:, 0], atol=1e-6)
