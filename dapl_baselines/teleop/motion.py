"""From a device's command to the joint residuals of one control step; nothing that is no number gets through."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64

from clutter6d.envs.action import ACTION_SIZE, ActionConfig
from clutter6d.envs.control_mode import cartesian_residuals
from clutter6d.errors import InvalidValueError
from clutter6d.geometry import quat_to_matrix
from clutter6d.sim.robot import JOINT_LOWER_RAD, JOINT_UPPER_RAD, hand_pose
from clutter6d.sim.robot_facts import TIP_OFFSET_M
from dapl_baselines.teleop.device import Command, DeviceLostError

PERSON_TO_WORLD = np.array([-1.0, -1.0, 1.0])
"""The person sits across the table and faces the robot, as the viewers' cameras do: away from them is towards it."""


@dataclass(frozen=True, kw_only=True, slots=True)
class MotionConfig:
    """How far full deflection moves the hand in one control step of 0.1 s.

    Attributes:
        translation_m: 0.3 m/s: the table's depth in 3 s, and below the bound of the Cartesian clipping (0.05 m).
        rotation_rad: 1.2 rad/s: a quarter turn in 1.3 s.
    """

    translation_m: float = 0.03
    rotation_rad: float = 0.12

    def __post_init__(self) -> None:
        """Refuse a hand that cannot move."""
        if not (0 < self.translation_m <= 0.1 and 0 < self.rotation_rad <= 0.5):
            raise InvalidValueError("a step of the hand is in (0, 0.1] m and (0, 0.5] rad")


def still() -> Float32[np.ndarray, "7"]:
    """Residuals that stop the arm where it is."""
    return np.zeros(ACTION_SIZE, dtype=np.float32)


def residuals_of(
    command: Command, arm_qpos: Float64[np.ndarray, "7"], action: ActionConfig, motion: MotionConfig
) -> Float32[np.ndarray, "7"]:
    """Joint residuals [rad] that do what a command asks, as far as one control step allows.

    Args:
        command: What the device said.
        arm_qpos: Current joint angles [rad].
        action: The benchmark's action mapping.
        motion: What full deflection means.

    Raises:
        DeviceLostError: The device gave something that is no number.
    """
    if command.joints is not None:
        wanted = np.clip(_numbers(command.joints, "joint angle"), JOINT_LOWER_RAD, JOINT_UPPER_RAD) - arm_qpos
    elif command.deflection is not None and command.deflection.any():
        deflection = np.clip(_numbers(command.deflection, "deflection"), -1.0, 1.0)
        delta = hand_delta(deflection, arm_qpos, motion)
        wanted = cartesian_residuals(delta[None], arm_qpos[None], action)[0]
    else:
        return still()
    return np.clip(wanted, -action.action_scale_rad, action.action_scale_rad).astype(np.float32)


def hand_delta(
    deflection: Float64[np.ndarray, "6"], arm_qpos: Float64[np.ndarray, "7"], motion: MotionConfig
) -> Float64[np.ndarray, "6"]:
    """Translation [m] and rotation vector [rad] of the hand's frame, world axes, that move the finger tips as wanted.

    A person pushes with the finger tips, so the hand turns about the point between them.
    """
    turn = motion.rotation_rad * PERSON_TO_WORLD * deflection[3:]
    fingers = TIP_OFFSET_M * quat_to_matrix(hand_pose(arm_qpos[None])[:, 3:])[0, :, 2]
    step = motion.translation_m * PERSON_TO_WORLD * deflection[:3]
    return np.concatenate([step - np.cross(turn, fingers), turn])


def _numbers(values: Float64[np.ndarray, "n"], what: str) -> Float64[np.ndarray, "n"]:
    if not np.isfinite(values).all():
        raise DeviceLostError(f"the device gave a {what} that is not a number; the arm stands still")
    return values
