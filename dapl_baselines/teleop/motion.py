"""From a device's command to the joint residuals of one control step; nothing that is no number gets through."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64
from scipy.spatial.transform import Rotation

from clutter6d.envs.action import ACTION_SIZE, ActionConfig
from clutter6d.envs.control_mode import cartesian_residuals
from clutter6d.errors import InvalidValueError
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
        lead_m: How far the point that leads the finger tips may be ahead of them: just below the same bound.
        lead_rad: How far the attitude that leads the hand may be ahead of it.
    """

    translation_m: float = 0.03
    rotation_rad: float = 0.12
    lead_m: float = 0.045
    lead_rad: float = 0.25

    def __post_init__(self) -> None:
        """Refuse a hand that cannot move."""
        if not (0 < self.translation_m <= 0.1 and 0 < self.rotation_rad <= 0.5):
            raise InvalidValueError("a step of the hand is in (0, 0.1] m and (0, 0.5] rad")


def still() -> Float32[np.ndarray, "7"]:
    """Residuals that stop the arm where it is."""
    return np.zeros(ACTION_SIZE, dtype=np.float32)


class Steering:
    """Turns commands into residuals, and keeps the hand on the line and in the attitude that were asked for.

    A step's residuals are right to first order only, and the arm trails its targets: uncorrected, 0.3 m sideways tilted
    the hand by 9 degrees. So the finger tips are led by a point, and the hand by an attitude, that move exactly as
    asked, but never far ahead of the arm: pushing at something heavy stores nothing up.

    Args:
        action: The benchmark's action mapping.
        motion: What full deflection means.
    """

    def __init__(self, action: ActionConfig, motion: MotionConfig) -> None:
        self._action, self._motion = action, motion
        self.forget()

    def forget(self) -> None:
        """Another attempt: start from the arm as it is."""
        self._tips: Float64[np.ndarray, 3] | None = None
        self._attitude: Rotation | None = None

    def residuals(self, command: Command, arm_qpos: Float64[np.ndarray, "7"]) -> Float32[np.ndarray, "7"]:
        """Joint residuals [rad] that do what a command asks, as far as one control step allows.

        Args:
            command: What the device said.
            arm_qpos: Current joint angles [rad].

        Raises:
            DeviceLostError: The device gave something that is no number.
        """
        if command.joints is not None:
            wanted = np.clip(_numbers(command.joints, "joint angle"), JOINT_LOWER_RAD, JOINT_UPPER_RAD) - arm_qpos
        elif command.deflection is not None and command.deflection.any():
            deflection = np.clip(_numbers(command.deflection, "deflection"), -1.0, 1.0)
            wanted = cartesian_residuals(self._lead(deflection, arm_qpos)[None], arm_qpos[None], self._action)[0]
        else:
            self._tips = None
            return still()
        return np.clip(wanted, -self._action.action_scale_rad, self._action.action_scale_rad).astype(np.float32)

    def _lead(
        self, deflection: Float64[np.ndarray, "6"], arm_qpos: Float64[np.ndarray, "7"]
    ) -> Float64[np.ndarray, "6"]:
        """Translation [m] and rotation vector [rad] of the hand's frame to where the finger tips are led.

        A person pushes with the finger tips, so the hand turns about the point between them.
        """
        pose = hand_pose(arm_qpos[None])[0]
        attitude = Rotation.from_quat(pose[3:], scalar_first=True)
        fingers = attitude.apply([0.0, 0.0, TIP_OFFSET_M])
        tips = pose[:3] + fingers
        step = self._motion.translation_m * PERSON_TO_WORLD * deflection[:3]
        turn = Rotation.from_rotvec(self._motion.rotation_rad * PERSON_TO_WORLD * deflection[3:])
        ahead = _at_most((tips if self._tips is None else self._tips) + step - tips, self._motion.lead_m)
        asked = turn * (attitude if self._attitude is None else self._attitude)
        tilt = _at_most((asked * attitude.inv()).as_rotvec(), self._motion.lead_rad)
        self._tips, self._attitude = tips + ahead, Rotation.from_rotvec(tilt) * attitude
        return np.concatenate([ahead - np.cross(tilt, fingers), tilt])


def _at_most(vector: Float64[np.ndarray, "3"], length: float) -> Float64[np.ndarray, "3"]:
    return vector * min(1.0, length / max(float(np.linalg.norm(vector)), 1e-12))


def _numbers(values: Float64[np.ndarray, "n"], what: str) -> Float64[np.ndarray, "n"]:
    if not np.isfinite(values).all():
        raise DeviceLostError(f"the device gave a {what} that is not a number; the arm stands still")
    return values
