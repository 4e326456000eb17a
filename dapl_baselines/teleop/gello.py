"""Driving by GELLO, a small copy of the arm whose joints are read (paper's teleoperation baseline; Wu et al., GELLO).

Motors 1 to 7 are the Franka's joints from the base up; motor 8, the trigger, is not read: the benchmark's hand has its
fingers closed. Signs and baud rate are those of GELLO's published build for the Franka.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float64
from pydantic import Field, field_validator

from clutter6d.errors import InvalidValueError
from clutter6d.schema import FileModel
from clutter6d.sim.robot import JOINT_LOWER_RAD, JOINT_UPPER_RAD
from dapl_baselines.teleop.device import Command
from dapl_baselines.teleop.dynamixel_bus import DynamixelBus

BAUD_RATE = 57_600
MOTOR_IDS = (1, 2, 3, 4, 5, 6, 7)
JOINT_SIGNS = (1, -1, 1, 1, 1, -1, 1)
SQUARE_POSE_RAD = np.array([0.0, 0.0, 0.0, -np.pi / 2, 0.0, np.pi / 2, 0.0])
"""Held while it is calibrated: upper arm upright, forearm level, hand straight down, nothing turned aside."""
MAX_MISALIGNMENT_RAD = 0.35
"""How far a joint may be from the square pose, or from the robot's before it follows: 20 degrees."""
_MIDDLE_RAD = (JOINT_LOWER_RAD + JOINT_UPPER_RAD) / 2

Seven = tuple[float, float, float, float, float, float, float]
MotorId = Annotated[int, Field(ge=0, le=252)]
SevenIds = tuple[MotorId, MotorId, MotorId, MotorId, MotorId, MotorId, MotorId]
Sign = Literal[-1, 1]


class GelloCalibration(FileModel):
    """Where the zero of each joint is; the file that ``clutter6d teleop --calibrate`` writes.

    Attributes:
        baud_rate: Bits a second of the bus.
        motor_ids: The motor of each joint, from the base up.
        signs: Whether motor and joint turn the same way.
        offsets_rad: Angle of each motor when its joint is at zero.
    """

    schema_version: Literal[1] = 1
    format: Literal["clutter6d-gello-calibration"] = "clutter6d-gello-calibration"
    baud_rate: int = Field(default=BAUD_RATE, gt=0)
    motor_ids: SevenIds = MOTOR_IDS
    signs: tuple[Sign, Sign, Sign, Sign, Sign, Sign, Sign] = JOINT_SIGNS
    offsets_rad: Seven

    @field_validator("motor_ids")
    @classmethod
    def _each_once(cls, motor_ids: SevenIds) -> SevenIds:
        for motor in motor_ids:
            if motor_ids.count(motor) > 1:
                raise ValueError(f"motor {motor} twice")
        return motor_ids

    def joint_angles(self, motor_angles: Float64[np.ndarray, "7"]) -> Float64[np.ndarray, "7"]:
        """Joint angles [rad] of what the motors show, in the turn that holds the joint's range."""
        angles = np.array(self.signs) * (motor_angles - np.array(self.offsets_rad))
        return _MIDDLE_RAD + (angles - _MIDDLE_RAD + np.pi) % (2 * np.pi) - np.pi


class GelloDevice:
    """A GELLO on a serial port.

    Args:
        port: The port's device file.
        calibration: Where its joints' zeros are.
    """

    name = "gello"
    help_lines = (
        "the small arm\tthe robot follows it, joint by joint",
        "before a start\thold it as the robot stands",
    )

    def __init__(self, port: Path, calibration: GelloCalibration) -> None:
        self._calibration = calibration
        self._bus = DynamixelBus(port, calibration.motor_ids, calibration.baud_rate)

    @property
    def settings(self) -> Mapping[str, object]:
        """The calibration."""
        return self._calibration.model_dump(mode="json")

    def connect(self) -> None:
        """Open the port, and see that every motor answers."""
        self._bus.open()
        self._bus.angles()

    def read(self, keys: Sequence[str]) -> Command:  # noqa: ARG002  it is not driven by keys
        """The joints' angles."""
        return Command(joints=self._calibration.joint_angles(self._bus.angles()))

    def close(self) -> None:
        """Close the port."""
        self._bus.close()


def calibrate(motor_angles: Float64[np.ndarray, "sample 7"]) -> GelloCalibration:
    """The calibration of a GELLO that is held in the square pose.

    Motors are mounted at quarter turns of their joints, so each offset is rounded to one: the mounting is more exact
    than a hand.

    Args:
        motor_angles: Some readings [rad].

    Raises:
        InvalidValueError: It was not held still, or a joint is too far from the square pose.
    """
    if np.ptp(motor_angles, axis=0).max() > 0.05:
        raise InvalidValueError("the GELLO moved while it was read; hold it still, and try again")
    offsets = motor_angles.mean(axis=0) - np.array(JOINT_SIGNS) * SQUARE_POSE_RAD
    rounded = np.round(offsets / (np.pi / 2)) * (np.pi / 2)
    error = np.abs(offsets - rounded)
    if error.max() > MAX_MISALIGNMENT_RAD:
        joint = int(error.argmax())
        raise InvalidValueError(
            f"joint {joint + 1} is {np.rad2deg(error[joint]):.0f} degrees from the square pose; "
            "hold the GELLO as docs/teleoperate.md shows, and try again"
        )
    return GelloCalibration.model_validate({"offsets_rad": tuple(rounded.tolist())})


def misalignment(joints: Float64[np.ndarray, "7"], arm_qpos: Float64[np.ndarray, "7"]) -> str | None:
    """Which joint must be moved how far before the robot may follow, or ``None`` if they agree."""
    error = arm_qpos - joints
    joint = int(np.abs(error).argmax())
    if abs(error[joint]) <= MAX_MISALIGNMENT_RAD:
        return None
    return f"turn joint {joint + 1} by {np.rad2deg(error[joint]):+.0f} degrees, to stand as the robot does"
