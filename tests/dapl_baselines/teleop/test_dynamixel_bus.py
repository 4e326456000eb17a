"""The real dynamixel-sdk on a pseudo-terminal, with simulated motors at the other end."""

import numpy as np
import pytest

from dapl_baselines.teleop.device import DeviceLostError
from dapl_baselines.teleop.dynamixel_bus import DynamixelBus
from tests.dapl_baselines.teleop.simulated_bus import SimulatedBus, crc16

IDS = tuple(range(1, 8))
ANGLES = np.array([0.1, -0.2, 3.0, -3.1, 6.5, -7.0, 0.0])


@pytest.fixture
def motors():
    with SimulatedBus() as motors:
        motors.set_angles(ANGLES)
        yield motors


@pytest.fixture
def bus(motors):
    bus = DynamixelBus(motors.port, IDS, 57_600)
    bus.open()
    yield bus
    bus.close()


def test_the_simulated_crc_is_the_one_of_the_protocols_own_example():
    ping = bytes([0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01])
    assert crc16(ping) == 0x4E19


def test_angles_are_read_to_a_tick_also_beyond_a_turn(bus):
    for _ in range(3):
        np.testing.assert_allclose(bus.angles(), ANGLES, atol=np.pi / 4096)


def test_a_position_whose_bytes_look_like_a_header_is_read(bus, motors):
    motors.ticks[3] = int.from_bytes(b"\xff\xff\xfd\xff", "little", signed=True)
    assert bus.angles()[2] == motors.ticks[3] * 2 * np.pi / 4096


def test_nothing_is_written_to_a_motor(bus, motors):
    bus.angles()
    assert motors.written == []


@pytest.mark.parametrize("fault", ["corrupt", "swallow"])
def test_a_damaged_packet_is_asked_for_once_more(bus, motors, fault):
    setattr(motors, fault, 1)
    np.testing.assert_allclose(bus.angles(), ANGLES, atol=np.pi / 4096)


def test_noise_before_a_packet_is_skipped(bus, motors):
    motors.noise = b"\x00\xff\xfd"
    np.testing.assert_allclose(bus.angles(), ANGLES, atol=np.pi / 4096)


def test_packets_that_stay_damaged_are_told_apart_from_silence(bus, motors):
    motors.corrupt = 8
    with pytest.raises(DeviceLostError, match="damaged packets"):
        bus.angles()
    np.testing.assert_allclose(bus.angles(), ANGLES, atol=np.pi / 4096)


def test_a_motor_that_does_not_answer_is_named(bus, motors):
    motors.silent = {3, 6}
    with pytest.raises(DeviceLostError, match="motor 3, 6 on .* does not answer"):
        bus.angles()
    motors.silent = set()
    np.testing.assert_allclose(bus.angles(), ANGLES, atol=np.pi / 4096)


def test_a_bus_without_power_is_told_apart_from_one_bad_motor(bus, motors):
    motors.silent = set(IDS)
    with pytest.raises(DeviceLostError, match="no motor answers .* 57600 baud"):
        bus.angles()


def test_an_unplugged_cable_is_one_line_and_can_be_plugged_in_again(bus, motors):
    motors.unplug()
    for _ in range(2):
        with pytest.raises(DeviceLostError, match="gone|not answer") as caught:
            bus.angles()
        assert "\n" not in str(caught.value)
    bus.close()
    with pytest.raises(DeviceLostError, match="serial port"):
        bus.open()
    with pytest.raises(DeviceLostError, match="not open"):
        bus.angles()


def test_a_port_that_is_not_there_is_named(tmp_path):
    with pytest.raises(DeviceLostError, match="ttyUSB9"):
        DynamixelBus(tmp_path / "ttyUSB9", IDS, 57_600).open()
