import numpy as np
import pytest

from clutter6d.geometry import quat_conjugate, quat_from_matrix, quat_multiply, quat_to_matrix
from clutter6d.seeding import generator
from clutter6d.sim.kinematics import hand_kinematics
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.robot_facts import BASE_POSITION_M, JOINT_LOWER_RAD, JOINT_UPPER_RAD
from dapl_baselines.planners.hand_servo import joint_steps, tip_positions
from dapl_baselines.push_policy.reach import LEANS_RAD, REACH_M, lean_to_reach, wrist_distances
from dapl_baselines.push_policy.tracker import FLIGHT_SPEED_M, HOME_SHARE, MAX_HOME_RAD, POINTING_DOWN
from dapl_baselines.push_policy.whole_pushes import _draw_hands

ARM_M = np.hypot(0.316, 0.0825) + np.hypot(0.384, 0.0825)
"""Shoulder to wrist with the arm stretched."""


def held(qpos: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tips and hands of joint angles."""
    hand = hand_kinematics(qpos)
    return tip_positions(hand.pose), quat_from_matrix(quat_to_matrix(hand.pose[:, 3:]) @ POINTING_DOWN)


def draw_places(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Tips above the table, and hands as pushes hold them."""
    rng = generator(0, "places")
    tips = rng.uniform([-0.3, -0.6, 0.01], [0.48, 0.6, 0.2], size=(count, 3))
    angle = rng.uniform(-np.pi, np.pi, size=count)
    normals = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)[:, None]
    return tips, _draw_hands(normals, -normals, rng)[:, 0]


def reached(tips: np.ndarray, hands: np.ndarray) -> np.ndarray:
    """Which tips come within a centimetre of where they should be, led there as flights are led."""
    rotations, qpos = quat_to_matrix(hands) @ POINTING_DOWN, np.tile(HOME_QPOS, (len(tips), 1))
    for _ in range(120):
        home = np.clip(HOME_SHARE * (HOME_QPOS - qpos), -MAX_HOME_RAD, MAX_HOME_RAD)
        steps = joint_steps(hand_kinematics(qpos), tips, rotations, np.full(len(tips), FLIGHT_SPEED_M), home)
        qpos = np.clip(qpos + steps, JOINT_LOWER_RAD, JOINT_UPPER_RAD)
    return np.linalg.norm(tip_positions(hand_kinematics(qpos).pose) - tips, axis=1) < 0.01


def test_no_joint_angles_hold_the_wrist_farther_away_than_the_arm_is_long():
    qpos = generator(0, "joints").uniform(JOINT_LOWER_RAD, JOINT_UPPER_RAD, size=(2_000, 7))
    distances = wrist_distances(*held(qpos))
    assert distances.max() < ARM_M + 1e-9 < REACH_M
    stretched = np.zeros((1, 7))
    stretched[0, 5] = 1.8
    assert wrist_distances(*held(stretched))[0] == pytest.approx(0.316 + 0.384, abs=1e-9)


def test_what_is_within_reach_is_reached_and_what_is_not_is_not():
    tips, hands = draw_places(300)
    distances, is_reached = wrist_distances(tips, hands), reached(tips, hands)
    is_near = (distances > 0.35) & (distances < ARM_M - 0.01)
    assert is_reached[is_near].mean() > 0.95
    assert not is_reached[distances > 0.80].any()


def test_hands_lean_outwards_as_far_as_it_takes():
    tips, hands = draw_places(500)
    leant, is_reached = lean_to_reach(tips, hands)
    before, after = (wrist_distances(tips, each) <= REACH_M for each in (hands, leant))
    assert np.array_equal(is_reached, after)
    assert after.sum() > before.sum() + 30
    assert np.array_equal(leant[before | ~after], hands[before | ~after])
    has_leant = after & ~before
    turns = quat_multiply(leant[has_leant], quat_conjugate(hands[has_leant]))
    angles = 2 * np.arctan2(np.linalg.norm(turns[:, 1:], axis=1), np.abs(turns[:, 0]))
    assert np.abs(angles[:, None] - LEANS_RAD).min(axis=1).max() < 1e-9
    fingers = [-quat_to_matrix(each[has_leant])[:, :, 2] for each in (hands, leant)]
    outward = (tips - np.array(BASE_POSITION_M))[has_leant]
    gained = ((fingers[1] - fingers[0]) * outward).sum(axis=1)
    assert (gained > 0).mean() > 0.95
    assert reached(tips[has_leant], leant[has_leant]).mean() > 0.85


def test_no_hands_are_no_hands():
    leant, is_reached = lean_to_reach(np.zeros((0, 3)), np.zeros((0, 4)))
    assert (leant.shape, is_reached.shape) == ((0, 4), (0,))
