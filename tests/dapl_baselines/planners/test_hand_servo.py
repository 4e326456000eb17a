import numpy as np

from clutter6d.geometry import quat_to_matrix
from clutter6d.seeding import generator
from clutter6d.sim.kinematics import hand_kinematics
from clutter6d.sim.robot import HOME_QPOS
from dapl_baselines.planners.hand_servo import joint_steps, tip_positions

QPOS = HOME_QPOS + generator(0, "joints").uniform(-0.3, 0.3, (200, 7))
HANDS = hand_kinematics(QPOS)
TIPS, ROTATIONS = tip_positions(HANDS.pose), quat_to_matrix(HANDS.pose[:, 3:])
SPEED = np.full(len(QPOS), 0.05)


def moved_tips(steps: np.ndarray) -> np.ndarray:
    return tip_positions(hand_kinematics(QPOS + steps).pose) - TIPS


def test_idle_steps_bring_the_elbow_home_and_leave_the_hand_where_it_is():
    wanted = 0.1 * (HOME_QPOS - QPOS)
    steps = joint_steps(HANDS, TIPS, ROTATIONS, SPEED, wanted)
    assert np.abs(moved_tips(steps)).max() < 2e-3
    assert np.abs(moved_tips(wanted)).max() > 2e-2
    before, after = (np.abs(joints - HOME_QPOS).sum(axis=1) for joints in (QPOS, QPOS + steps))
    assert (after < before).mean() > 0.9
    np.testing.assert_allclose(joint_steps(HANDS, TIPS, ROTATIONS, SPEED), 0, atol=1e-12)


def test_they_do_not_turn_the_hand_from_its_way():
    way = generator(0, "ways").normal(size=TIPS.shape)
    way *= 0.01 / np.linalg.norm(way, axis=1, keepdims=True)
    for wanted in (None, 0.05 * (HOME_QPOS - QPOS)):
        steps = joint_steps(HANDS, TIPS + way, ROTATIONS, SPEED, wanted)
        assert np.linalg.norm(moved_tips(steps) - way, axis=1).max() < 2e-3
