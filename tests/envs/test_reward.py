import numpy as np
import pytest

from clutter6d.envs.reward import RewardConfig, compute_reward, disturbance_factor
from clutter6d.geometry import quat_from_yaw

CONFIG = RewardConfig()
START = np.array([[[0.0, 0, 0.05, 1, 0, 0, 0], [0.2, 0, 0.05, 1, 0, 0, 0], [0, 0.3, 0.05, 1, 0, 0, 0]]])
GOAL = np.array([[0.3, 0.0, 0.05, 1, 0, 0, 0]])


def fingers(distance: float, target: np.ndarray = START) -> np.ndarray:
    near = target[:, 0, :3] + [0, 0, distance]
    return np.stack([near, near + [0, 0, 1.0]], axis=1)


def test_far_from_the_target_only_proximity_counts():
    terms = compute_reward(START, START, GOAL, fingers(0.2), CONFIG)
    np.testing.assert_allclose(terms.proximity, 1 - np.tanh(2.0))
    assert terms.coarse[0] == terms.fine[0] == terms.success[0] == 0
    np.testing.assert_allclose(terms.total, terms.proximity)


def test_near_the_target_the_goal_terms_follow_the_papers_formula():
    poses = START.copy()
    poses[0, 0, 3:] = quat_from_yaw(0.5)
    terms = compute_reward(poses, START, GOAL, fingers(0.05), CONFIG)
    error = 0.3 + 0.5 / 5
    np.testing.assert_allclose(terms.coarse, 5 * (1 - np.tanh(error / 0.6)))
    np.testing.assert_allclose(terms.fine, 16 * (1 - np.tanh(error / 0.3)))


def test_success_is_planar_in_the_reward():
    poses = START.copy()
    poses[0, 0] = GOAL[0]
    poses[0, 0, 2] += 0.2
    assert compute_reward(poses, START, GOAL, fingers(1.0), CONFIG).success[0] == 2000


@pytest.mark.parametrize(
    ("shift", "yaw", "factor"),
    [(0.0, 0.0, 1.0), (0.05, 0.0, 0.875), (0.1, 0.0, 0.75), (9.0, 0.0, 0.75), (9.0, np.pi / 4, 0.5), (9.0, 3.0, 0.5)],
)
def test_moved_obstacles_take_up_to_half_of_a_success(shift, yaw, factor):
    moved = START[:, 1:].copy()
    moved[..., 0] += shift
    moved[..., 3:] = quat_from_yaw(yaw)
    np.testing.assert_allclose(disturbance_factor(moved, START[:, 1:], CONFIG), factor)


def test_without_obstacles_nothing_is_taken():
    assert disturbance_factor(START[:, :0], START[:, :0], CONFIG)[0] == 1
