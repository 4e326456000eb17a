import numpy as np
import pytest

from clutter6d.geometry import (
    quat_from_axis_angle,
    quat_from_yaw,
    quat_multiply,
    quat_to_matrix,
    rotation_error_rad,
)
from clutter6d.seeding import generator
from clutter6d.sim.robot import HOME_QPOS, hand_pose
from dapl_baselines.planners.config import PushConfig
from dapl_baselines.planners.contact_points import sample_contact_points
from dapl_baselines.planners.hand_servo import servo_residuals, tip_positions
from dapl_baselines.planners.motions import tilt_and_twist
from dapl_baselines.planners.pushes import draw_pushes
from tests.scene_fixtures import make_box_asset

CONTACTS = sample_contact_points(make_box_asset("box", (0.06, 0.06, 0.10)))
POSE = np.array([0.0, 0.0, 0.05, 1.0, 0.0, 0.0, 0.0])


def _draw(goal: np.ndarray, count: int = 200, **settings):
    return draw_pushes(CONTACTS, POSE, goal, count, PushConfig(**settings), generator(0, "test"))


def test_a_push_for_translation_starts_behind_the_object_and_leads_to_the_goal():
    goal = POSE + np.array([0.0, 0.3, 0, 0, 0, 0, 0])
    pushes = _draw(goal)
    behind = pushes.start[:, 1] < -0.03
    assert behind.mean() > 0.9
    assert (pushes.direction[behind, 1] > 0.7).mean() > 0.9


def test_a_push_for_a_topple_touches_the_upper_half():
    fallen = quat_from_axis_angle(np.array([1.0, 0.0, 0.0]), np.pi / 2)
    pushes = _draw(np.concatenate([POSE[:3], fallen]), tipping_shares=(0.0, 1.0, 0.0, 0.0))
    sideways = np.abs(pushes.start[:, 1]) > 0.03
    assert (pushes.start[sideways, 2] > 0.05).mean() > 0.8


def test_no_tip_goes_into_the_table():
    pushes = _draw(POSE + np.array([0.2, 0, 0, 0, 0, 0, 0]))
    config = PushConfig()
    assert (pushes.start[:, 2] >= config.min_tip_height_m).all()
    assert (pushes.hover > pushes.start[:, 2]).all()


def test_hands_point_down():
    pushes = _draw(POSE + np.array([0.2, 0, 0, 0, 0, 0, 0]))
    assert np.median(pushes.hand_rotation[:, 2, 2]) < -0.9
    determinants = np.linalg.det(pushes.hand_rotation)
    np.testing.assert_allclose(determinants, 1.0, atol=1e-9)


def test_the_servo_brings_the_tips_to_a_point_and_the_hand_upright():
    arm = HOME_QPOS[None].copy()
    start = tip_positions(hand_pose(arm))
    target = start + np.array([[0.1, 0.15, -0.05]])
    upright = np.diag([1.0, -1.0, -1.0])[None]
    for _ in range(40):
        arm += servo_residuals(arm, target, upright, np.array([0.03]))
    np.testing.assert_allclose(tip_positions(hand_pose(arm)), target, atol=2e-3)
    assert quat_to_matrix(hand_pose(arm)[:, 3:])[0, 2, 2] < -0.95


@pytest.mark.parametrize("tilt_rad", [0.0, 0.3, 1.5, 3.0])
@pytest.mark.parametrize("twist_rad", [-2.5, 0.0, 1.0])
def test_tilt_then_twist_is_the_whole_turn(tilt_rad, twist_rad):
    axis = np.array([0.6, 0.8, 0.0])
    start = quat_from_axis_angle(np.array([0.0, 1.0, 0.0]), 0.7)
    turn = quat_multiply(quat_from_yaw(twist_rad), quat_from_axis_angle(axis, tilt_rad))
    tilt, twist = tilt_and_twist(start, quat_multiply(turn, start))
    length = np.linalg.norm(tilt)
    again = quat_from_axis_angle(tilt / max(length, 1e-12), length)
    assert rotation_error_rad(quat_multiply(quat_from_yaw(twist), again), turn) < 1e-6
    np.testing.assert_allclose(length, tilt_rad, atol=1e-6)
