"""Joint residuals that move the finger tips to a point with the hand turned a given way, by damped least squares."""

import numpy as np
from jaxtyping import Float64

from clutter6d.geometry import quat_to_matrix
from clutter6d.sim.kinematics import HandKinematics, hand_kinematics
from clutter6d.sim.robot_facts import TIP_OFFSET_M

ROTATION_WEIGHT_M = 0.09
"""A radian of misalignment weighs as much as so many metres: position first, orientation as it comes."""
DAMPING = 0.02
MAX_TURN_RAD = 0.25


def tip_positions(hand_poses: Float64[np.ndarray, "n 7"]) -> Float64[np.ndarray, "n 3"]:
    """World positions of the point between the finger tips."""
    return hand_poses[:, :3] + TIP_OFFSET_M * quat_to_matrix(hand_poses[:, 3:])[:, :, 2]


def servo_residuals(
    arm_qpos: Float64[np.ndarray, "n 7"],
    tip_targets: Float64[np.ndarray, "n 3"],
    hand_rotations: Float64[np.ndarray, "n 3 3"],
    speed_m: Float64[np.ndarray, "n"],
) -> Float64[np.ndarray, "n 7"]:
    """Residuals of one control step towards a target: the joint steps that would reach it if the arm followed at once.

    Args:
        arm_qpos: Joint angles [rad].
        tip_targets: Where the tips shall go, world frame [m].
        hand_rotations: How the hand shall be turned, hand frame to world frame.
        speed_m: Largest movement of the tips in this step.
    """
    return joint_steps(hand_kinematics(arm_qpos), tip_targets, hand_rotations, speed_m)


def joint_steps(
    hand: HandKinematics[np.ndarray],
    tip_targets: Float64[np.ndarray, "n 3"],
    hand_rotations: Float64[np.ndarray, "n 3 3"],
    speed_m: Float64[np.ndarray, "n"],
    idle_steps: Float64[np.ndarray, "n 7"] | None = None,
    *,
    max_turn_rad: Float64[np.ndarray, "n"] | float = MAX_TURN_RAD,
) -> Float64[np.ndarray, "n 7"]:
    """Movements of the joints [rad] that take the hand towards a target.

    Args:
        hand: Kinematics of the hands.
        tip_targets: Where the tips shall go, world frame [m].
        hand_rotations: How the hand shall be turned, hand frame to world frame.
        speed_m: Largest movement of the tips in this step.
        idle_steps: Movements wanted besides [rad], of which only what leaves the hand where it is is made.
        max_turn_rad: Largest turn of the hand in this step, about each axis of the world.
    """
    rotation, tip = quat_to_matrix(hand.pose[:, 3:]), tip_positions(hand.pose)
    lever = (tip - hand.pose[:, :3])[:, None]
    angular = hand.jacobian[:, 3:].transpose(0, 2, 1)
    linear = hand.jacobian[:, :3].transpose(0, 2, 1) + np.cross(angular, lever)
    step = tip_targets - tip
    length = np.sqrt((step**2).sum(axis=-1, keepdims=True))
    step = step * np.minimum(1.0, speed_m[:, None] / np.maximum(length, 1e-9))
    columns = [np.cross(rotation[:, :, axis], hand_rotations[:, :, axis]) for axis in range(3)]
    most = np.asarray(max_turn_rad)[..., None]
    turn = np.clip((columns[0] + columns[1] + columns[2]) / 2, -most, most)
    rows = np.concatenate([linear, ROTATION_WEIGHT_M * angular], axis=-1)
    error = np.concatenate([step, ROTATION_WEIGHT_M * turn], axis=-1)
    normal = np.einsum("nji,njk->nik", rows, rows) + DAMPING**2 * np.eye(6)
    if idle_steps is not None:
        error = error - np.einsum("nji,nj->ni", rows, idle_steps)
    weights = np.linalg.solve(normal, error[..., None])[..., 0]
    steps = np.einsum("nji,ni->nj", rows, weights)
    return steps if idle_steps is None else steps + idle_steps
