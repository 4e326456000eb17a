"""Reading a GELLO that is held still, to find its zeros."""

import time
from contextlib import closing
from pathlib import Path

import numpy as np

from dapl_baselines.teleop.dynamixel_bus import DynamixelBus
from dapl_baselines.teleop.gello import BAUD_RATE, MOTOR_IDS, GelloCalibration, calibrate

SAMPLES = 20
INTERVAL_S = 0.02


def read_calibration(port: Path) -> GelloCalibration:
    """The calibration of a GELLO that is held in the square pose now.

    Args:
        port: Its serial port.

    Raises:
        DeviceLostError: It cannot be read.
        InvalidValueError: It moved, or a joint is far from the square pose.
    """
    with closing(DynamixelBus(port, MOTOR_IDS, BAUD_RATE)) as bus:
        bus.open()
        readings: list[np.ndarray] = []
        for _ in range(SAMPLES):
            readings.append(bus.angles())
            time.sleep(INTERVAL_S)
    return calibrate(np.stack(readings))
