"""A virtual gamepad of SDL's own: everything below SDL's joystick layer (kernel, cable) is left out."""

import ctypes
from pathlib import Path

import numpy as np
import pytest

from dapl_baselines.teleop.device import DeviceLostError
from dapl_baselines.teleop.gamepad import DEAD_BAND, GamepadDevice

pygame = pytest.importorskip("pygame")
_GAMECONTROLLER = 1
LEFT_X, LEFT_Y, RIGHT_X, RIGHT_Y, LEFT_TRIGGER, RIGHT_TRIGGER = range(6)
BACK, START, LEFT_SHOULDER, RIGHT_SHOULDER = 4, 6, 9, 10


class VirtualPad:
    """A gamepad that is plugged into SDL."""

    def __init__(self) -> None:
        folder = Path(pygame.__file__).parents[1] / "pygame_ce.libs"
        self._sdl = ctypes.CDLL(str(next(folder.glob("libSDL2-2*"))))
        self._sdl.SDL_JoystickFromInstanceID.restype = ctypes.c_void_p
        self._index = self._sdl.SDL_JoystickAttachVirtual(_GAMECONTROLLER, 6, 15, 0)
        assert self._index >= 0
        self._joystick = pygame.joystick.Joystick(self._index)
        self._handle = ctypes.c_void_p(self._sdl.SDL_JoystickFromInstanceID(self._joystick.get_instance_id()))
        for trigger in (LEFT_TRIGGER, RIGHT_TRIGGER):
            self.move(trigger, -1.0)

    def move(self, axis: int, share: float) -> None:
        self._sdl.SDL_JoystickSetVirtualAxis(self._handle, axis, ctypes.c_int16(round(32767 * share)))

    def press(self, button: int, is_down: bool = True) -> None:
        self._sdl.SDL_JoystickSetVirtualButton(self._handle, button, int(is_down))

    def unplug(self) -> None:
        if self._index >= 0:
            self._sdl.SDL_JoystickDetachVirtual(self._index)
        self._index = -1


@pytest.fixture
def sdl():
    """SDL as the device starts it, without any gamepad."""
    with pytest.raises(DeviceLostError, match="no gamepad is plugged in"):
        GamepadDevice().connect()


@pytest.fixture
def pad(sdl):
    pad = VirtualPad()
    yield pad
    pad.unplug()


@pytest.fixture
def device(pad):
    device = GamepadDevice()
    device.connect()
    yield device
    device.close()


@pytest.mark.parametrize(
    ("axis", "share", "expected"),
    [
        (LEFT_Y, -1.0, [1, 0, 0, 0, 0, 0]),
        (LEFT_X, -1.0, [0, 1, 0, 0, 0, 0]),
        (RIGHT_TRIGGER, 1.0, [0, 0, 1, 0, 0, 0]),
        (LEFT_TRIGGER, 1.0, [0, 0, -1, 0, 0, 0]),
        (RIGHT_Y, -1.0, [0, 0, 0, 0, 1, 0]),
        (RIGHT_X, -1.0, [0, 0, 0, 0, 0, 1]),
    ],
)
def test_sticks_and_triggers_move_along_or_about_one_axis(pad, device, axis, share, expected):
    pad.move(axis, share)
    np.testing.assert_allclose(device.read(()).deflection, expected, atol=1e-3)


@pytest.mark.parametrize(("button", "direction"), [(RIGHT_SHOULDER, 1), (LEFT_SHOULDER, -1)])
def test_shoulder_buttons_lean_the_hand_sideways(pad, device, button, direction):
    pad.press(button)
    np.testing.assert_array_equal(device.read(()).deflection, [0, 0, 0, direction, 0, 0])


def test_a_worn_stick_does_not_creep(pad, device):
    pad.move(LEFT_X, 0.9 * DEAD_BAND)
    assert not device.read(()).deflection.any()


def test_a_button_asks_once_however_long_it_is_held(pad, device):
    pad.press(START)
    assert device.read(()).wishes == ("toggle",)
    assert device.read(()).wishes == ()
    pad.press(BACK)
    assert device.read(()).wishes == ("give_up",)


def test_an_unplugged_gamepad_is_one_line_and_can_be_plugged_in_again(pad, device):
    pad.move(LEFT_Y, -1.0)
    pad.unplug()
    with pytest.raises(DeviceLostError, match="the gamepad is gone"):
        device.read(())
    with pytest.raises(DeviceLostError, match="no gamepad is plugged in"):
        device.connect()
    with pytest.raises(DeviceLostError, match="not open"):
        device.read(())
    again = VirtualPad()
    device.connect()
    assert not device.read(()).deflection.any()
    again.unplug()
