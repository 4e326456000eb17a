"""HID reports through a packet pipe, which hands them out one at a time as Linux's raw HID files do."""

import fcntl
import os
import struct
from pathlib import Path

import numpy as np
import pytest

from dapl_baselines.teleop.device import DeviceLostError
from dapl_baselines.teleop.spacemouse import DEAD_BAND, SILENCE_S, SpaceMouseDevice, find_space_mouse

PUSHED = [0, -350, 0]
"""Raw translation of a cap that is pushed away from the person."""


class Reports:
    """The other end of a raw HID file."""

    def __init__(self) -> None:
        self._reader, self._writer = os.pipe2(os.O_DIRECT)
        fcntl.fcntl(self._writer, fcntl.F_SETPIPE_SZ, 1 << 20)
        self.port = Path(f"/proc/self/fd/{self._reader}")
        self.now = 0.0

    def send(self, kind: int, *values: int) -> None:
        os.write(self._writer, bytes([kind]) + struct.pack(f"<{len(values)}h", *values))

    def press(self, *buttons: int) -> None:
        os.write(self._writer, bytes([3, sum(1 << button for button in buttons), 0]))

    def raw(self, content: bytes) -> None:
        os.write(self._writer, content)

    def unplug(self) -> None:
        if self._writer >= 0:
            os.close(self._writer)
            os.close(self._reader)
        self._writer = -1


@pytest.fixture
def mouse():
    mouse = Reports()
    yield mouse
    mouse.unplug()


@pytest.fixture
def device(mouse):
    device = SpaceMouseDevice(mouse.port, lambda: mouse.now)
    device.connect()
    yield device
    device.close()


@pytest.mark.parametrize(
    ("raw", "direction"),
    [([0, -350, 0], [1, 0, 0]), ([-350, 0, 0], [0, 1, 0]), ([0, 0, -350], [0, 0, 1])],
    ids=["pushed away", "to the left", "lifted"],
)
def test_the_finger_tips_go_where_the_cap_is_pushed(mouse, device, raw, direction):
    mouse.send(1, *raw)
    np.testing.assert_allclose(device.read(()).deflection, [*direction, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("raw", "axis"),
    [([0, -350, 0], [1, 0, 0]), ([-350, 0, 0], [0, 1, 0]), ([0, 0, -350], [0, 0, 1])],
)
def test_the_hand_turns_as_the_cap_does(mouse, device, raw, axis):
    mouse.send(2, *raw)
    np.testing.assert_allclose(device.read(()).deflection, [0, 0, 0, *axis], atol=1e-12)


def test_models_that_send_all_six_values_in_one_report_are_read(mouse, device):
    mouse.send(1, 0, -350, 0, 0, 0, 350)
    np.testing.assert_allclose(device.read(()).deflection, [1, 0, 0, 0, 0, -1], atol=1e-12)


def test_the_newest_of_many_reports_counts(mouse, device):
    for value in range(0, -351, -10):
        mouse.send(1, 0, value, 0)
    mouse.send(1, 0, -100, 0)
    share = (100 / 350 - DEAD_BAND) / (1 - DEAD_BAND)
    assert device.read(()).deflection[0] == pytest.approx(share)


def test_a_cap_at_rest_does_not_creep(mouse, device):
    mouse.send(1, 20, -20, 20)
    assert not device.read(()).deflection.any()


def test_values_beyond_full_scale_count_as_full(mouse, device):
    mouse.send(1, 0, -32768, 32767)
    np.testing.assert_allclose(device.read(()).deflection[:3], [1, 0, -1], atol=1e-12)


def test_silence_stops_the_arm(mouse, device):
    mouse.send(1, *PUSHED)
    assert device.read(()).deflection.any()
    mouse.now += SILENCE_S + 0.01
    assert not device.read(()).deflection.any()


def test_a_button_asks_once_however_long_it_is_held(mouse, device):
    mouse.press(0)
    mouse.press(0)
    assert device.read(()).wishes == ("toggle",)
    mouse.press(0, 1)
    assert device.read(()).wishes == ("give_up",)
    mouse.press()
    mouse.press(0)
    assert device.read(()).wishes == ("toggle",)


@pytest.mark.parametrize("content", [b"\x01", b"\x01\x02\x03", b"\x02\x00", b"\x03", b"\x17\xff\xff\xff", b"\x00" * 64])
def test_reports_that_are_none_are_passed_over(mouse, device, content):
    mouse.raw(content)
    command = device.read(())
    assert not command.deflection.any()
    assert command.wishes == ()


def test_an_unplugged_mouse_is_one_line(mouse, device):
    mouse.send(1, *PUSHED)
    mouse.unplug()
    with pytest.raises(DeviceLostError, match="unplugged"):
        device.read(())
    with pytest.raises(DeviceLostError, match="No such file"):
        device.connect()
    with pytest.raises(DeviceLostError, match="not open"):
        device.read(())


def list_device(system: Path, name: str, hid_id: str) -> None:
    folder = system / name / "device"
    folder.mkdir(parents=True)
    (folder / "uevent").write_text(f"DRIVER=hid-generic\nHID_ID={hid_id}\nHID_NAME=something\n")


@pytest.mark.parametrize("hid_id", ["0003:0000256F:0000C635", "0003:0000046D:0000C626"])
def test_a_plugged_in_mouse_is_found_among_other_devices(tmp_path, hid_id):
    list_device(tmp_path, "hidraw0", "0003:0000046D:0000C52B")
    list_device(tmp_path, "hidraw1", hid_id)
    assert find_space_mouse(tmp_path) == Path("/dev/hidraw1")


def test_no_mouse_is_one_line(tmp_path):
    with pytest.raises(DeviceLostError, match="no SpaceMouse is plugged in"):
        find_space_mouse(tmp_path)
