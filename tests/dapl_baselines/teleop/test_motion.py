import numpy as np
import pytest

from clutter6d.envs.action import ActionConfig
from clutter6d.geometry import quat_to_matrix
from clutter6d.sim.robot import HOME_QPOS, JOINT_LOWER_RAD, JOINT_UPPER_RAD, hand_pose
from clutter6d.sim.robot_facts import TIP_OFFSET_M
from dapl_baselines.teleop.device import Command, DeviceLostError
from dapl_baselines.teleop.motion import PERSON_TO_WORLD, MotionConfig, Steering

ACTION, MOTION = ActionConfig(), MotionConfig()


def ask(command: Command) -> np.ndarray:
    return Steering(ACTION, MOTION).residuals(command, HOME_QPOS)


def tips(qpos) -> tuple[np.ndarray, np.ndarray]:
    pose = hand_pose(np.asarray(qpos, dtype=np.float64)[None])[0]
    rotation = quat_to_matrix(pose[3:])
    return pose[:3] + TIP_OFFSET_M * rotation[:, 2], rotation


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_translation_moves_the_finger_tips_along_a_world_axis(axis, sign):
    deflection = np.zeros(6)
    deflection[axis] = 0.5 * sign
    moved = tips(HOME_QPOS + ask(Command(deflection=deflection)))[0] - tips(HOME_QPOS)[0]
    expected = 0.5 * sign * MOTION.translation_m * PERSON_TO_WORLD * np.eye(3)[axis]
    np.testing.assert_allclose(moved, expected, atol=0.1 * MOTION.translation_m)


def test_away_from_the_person_is_towards_the_robot():
    away = tips(HOME_QPOS + ask(Command(deflection=np.array([1.0, 0, 0, 0, 0, 0]))))[0] - tips(HOME_QPOS)[0]
    left = tips(HOME_QPOS + ask(Command(deflection=np.array([0, 1.0, 0, 0, 0, 0]))))[0] - tips(HOME_QPOS)[0]
    assert away[0] < -0.02
    assert left[1] < -0.02


@pytest.mark.parametrize("axis", range(3))
def test_rotation_turns_the_hand_about_its_finger_tips(axis):
    deflection = np.zeros(6)
    deflection[3 + axis] = 0.5
    after, rotation_after = tips(HOME_QPOS + ask(Command(deflection=deflection)))
    before, rotation_before = tips(HOME_QPOS)
    np.testing.assert_allclose(after, before, atol=0.004)
    turn = rotation_after @ rotation_before.T
    vector = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    np.testing.assert_allclose(vector, 0.5 * MOTION.rotation_rad * PERSON_TO_WORLD * np.eye(3)[axis], atol=0.012)


def test_joint_angles_are_followed_by_at_most_the_action_scale():
    wanted = HOME_QPOS + np.array([0.05, -0.05, 3.0, -3.0, 0.0, 0.02, -0.02])
    expected = np.array([0.05, -0.05, 0.1, -0.1, 0.0, 0.02, -0.02], dtype=np.float32)
    np.testing.assert_allclose(ask(Command(joints=wanted)), expected, atol=1e-7)


def test_joint_angles_beyond_the_limits_are_taken_as_the_limits():
    near = JOINT_UPPER_RAD - 0.01
    asked = Steering(ACTION, MOTION).residuals(Command(joints=np.full(7, 1e9)), near)
    np.testing.assert_allclose(asked, 0.01, atol=1e-6)
    asked = Steering(ACTION, MOTION).residuals(Command(joints=np.full(7, -1e9)), JOINT_LOWER_RAD + 0.01)
    np.testing.assert_allclose(asked, -0.01, atol=1e-6)


def test_a_deflection_out_of_range_counts_as_full():
    full = ask(Command(deflection=np.array([1.0, 0, 0, 0, 0, 0])))
    np.testing.assert_array_equal(ask(Command(deflection=np.array([1e30, 0, 0, 0, 0, 0]))), full)
    assert np.abs(full).max() <= np.float32(ACTION.action_scale_rad)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_never_reaches_the_arm(bad):
    for command in (Command(deflection=np.array([0, bad, 0, 0, 0, 0])), Command(joints=np.full(7, bad))):
        with pytest.raises(DeviceLostError, match="not a number"):
            ask(command)


def test_no_command_stands_still():
    for command in (Command(), Command(deflection=np.zeros(6))):
        assert ask(command).dtype == np.float32
        assert not ask(command).any()


def test_moving_is_the_same_to_the_bit_each_time():
    command = Command(deflection=np.array([0.3, -0.2, 0.1, 0.4, -0.5, 0.6]))
    np.testing.assert_array_equal(ask(command), ask(command))


def drive(deflection, steps: int, *, blocked: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Tips and attitude before and after steps of an arm that does 70% of what it is told, or nothing."""
    steering, qpos = Steering(ACTION, MOTION), HOME_QPOS.copy()
    for _ in range(steps):
        qpos = qpos + (0.0 if blocked else 0.7) * steering.residuals(Command(deflection=np.array(deflection)), qpos)
    return qpos, steering.residuals(Command(deflection=np.array(deflection)), qpos)


def test_a_long_way_leaves_neither_its_line_nor_the_hands_attitude():
    qpos, _ = drive([0, -0.5, 0, 0, 0, 0], 20)
    (before, rotation_before), (after, rotation_after) = tips(HOME_QPOS), tips(qpos)
    assert after[1] - before[1] > 0.2
    assert np.abs(after - before)[[0, 2]].max() < 0.02
    assert np.arccos((np.trace(rotation_after @ rotation_before.T) - 1) / 2) < np.deg2rad(4)


def test_pushing_at_what_does_not_give_stores_nothing_up():
    _, soon = drive([0, 0, -0.5, 0, 0.5, 0], 10, blocked=True)
    _, late = drive([0, 0, -0.5, 0, 0.5, 0], 200, blocked=True)
    np.testing.assert_allclose(late, soon, atol=1e-6)


def test_the_arm_stands_as_soon_as_nothing_is_asked():
    steering = Steering(ACTION, MOTION)
    steering.residuals(Command(deflection=np.array([1.0, 0, 0, 0, 0, 1.0])), HOME_QPOS)
    assert not steering.residuals(Command(deflection=np.zeros(6)), HOME_QPOS).any()
