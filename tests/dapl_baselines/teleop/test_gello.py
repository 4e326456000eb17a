import numpy as np
import pytest

from clutter6d.errors import InvalidFileError, InvalidValueError
from clutter6d.schema import read_model, write_model
from clutter6d.sim.robot import HOME_QPOS, JOINT_LOWER_RAD, JOINT_UPPER_RAD
from dapl_baselines.teleop.gello import (
    JOINT_SIGNS,
    SQUARE_POSE_RAD,
    GelloCalibration,
    GelloDevice,
    calibrate,
    misalignment,
)
from tests.dapl_baselines.teleop.simulated_bus import SimulatedBus

OFFSETS = np.array([1, 2, -1, 3, 0, 4, 1]) * np.pi / 2
CALIBRATION = GelloCalibration(offsets_rad=tuple(OFFSETS))


def motor_angles(joints) -> np.ndarray:
    return np.array(JOINT_SIGNS) * joints + OFFSETS


def test_joint_angles_are_those_the_arm_is_held_at():
    for joints in (HOME_QPOS, JOINT_LOWER_RAD, JOINT_UPPER_RAD, SQUARE_POSE_RAD):
        np.testing.assert_allclose(CALIBRATION.joint_angles(motor_angles(joints)), joints, atol=1e-12)


def test_whole_turns_of_a_motor_do_not_matter():
    turned = motor_angles(HOME_QPOS) + 2 * np.pi * np.array([1, -1, 2, 0, -3, 1, 1])
    np.testing.assert_allclose(CALIBRATION.joint_angles(turned), HOME_QPOS, atol=1e-12)


def test_calibration_finds_the_quarter_turns_the_motors_were_mounted_at():
    held = motor_angles(SQUARE_POSE_RAD + np.array([0.1, -0.2, 0.05, 0.3, -0.3, 0.0, 0.1]))
    found = calibrate(np.tile(held, (20, 1)))
    np.testing.assert_allclose(found.offsets_rad, OFFSETS, atol=1e-12)


def test_calibration_refuses_a_joint_that_is_far_off_and_names_it():
    held = motor_angles(SQUARE_POSE_RAD + np.array([0, 0, 0, 0.6, 0, 0, 0]))
    with pytest.raises(InvalidValueError, match="joint 4 is 34 degrees from the square pose"):
        calibrate(np.tile(held, (20, 1)))


def test_calibration_refuses_an_arm_that_moves():
    held = motor_angles(SQUARE_POSE_RAD) + np.linspace(0, 0.1, 20)[:, None]
    with pytest.raises(InvalidValueError, match="hold it still"):
        calibrate(held)


def test_a_calibration_comes_back_from_its_file(tmp_path):
    write_model(tmp_path / "gello.json", CALIBRATION)
    assert read_model(tmp_path / "gello.json", GelloCalibration, what="GELLO calibration") == CALIBRATION


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ('"signs": [\n  1', '"signs": [\n  2', "signs.0"),
        ("57600", "0", "baud_rate"),
        ("[\n", "[\n  1.0,\n", "motor_ids"),
    ],
)
def test_a_calibration_that_is_none_is_refused_by_its_field(tmp_path, old, new, field):
    path = tmp_path / "gello.json"
    write_model(path, CALIBRATION)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InvalidFileError, match=field):
        read_model(path, GelloCalibration, what="GELLO calibration")


def test_the_device_reads_the_joints_through_the_real_sdk():
    with SimulatedBus() as motors:
        motors.set_angles(motor_angles(HOME_QPOS))
        device = GelloDevice(motors.port, CALIBRATION)
        device.connect()
        np.testing.assert_allclose(device.read(()).joints, HOME_QPOS, atol=1e-3)
        device.close()


def test_a_start_needs_the_arm_to_stand_as_the_robot_does():
    assert misalignment(HOME_QPOS + 0.2, HOME_QPOS) is None
    held = HOME_QPOS + np.array([0.1, 0, -0.7, 0, 0, 0, 0])
    assert misalignment(held, HOME_QPOS) == "turn joint 3 by +40 degrees, to stand as the robot does"
