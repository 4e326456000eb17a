"""The devices by name."""

from pathlib import Path

from clutter6d.errors import InvalidValueError, MissingFileError, UnknownNameError
from clutter6d.schema import read_model
from dapl_baselines.teleop.gamepad import GamepadDevice
from dapl_baselines.teleop.gello import GelloCalibration, GelloDevice
from dapl_baselines.teleop.keyboard import KeyboardDevice
from dapl_baselines.teleop.spacemouse import SpaceMouseDevice

Device = KeyboardDevice | GamepadDevice | SpaceMouseDevice | GelloDevice
DEVICES = ("keyboard", "gamepad", "spacemouse", "gello")


def make_device(name: str, port: Path | None, calibration: Path) -> Device:
    """A device that is not connected yet.

    Args:
        name: One of :data:`DEVICES`.
        port: Device file of a GELLO, which must be given, or of a SpaceMouse.
        calibration: File of a GELLO's calibration.

    Raises:
        UnknownNameError: There is no such device.
        InvalidValueError: A port is missing, or makes no sense.
        MissingFileError: The GELLO was not calibrated.
        InvalidFileError: Its calibration is damaged.
    """
    if name not in DEVICES:
        raise UnknownNameError("device", name, DEVICES)
    if name in ("keyboard", "gamepad") and port is not None:
        raise InvalidValueError(f"a {name} has no port; leave out --port {port}")
    if name == "keyboard":
        return KeyboardDevice()
    if name == "gamepad":
        return GamepadDevice()
    if name == "spacemouse":
        return SpaceMouseDevice(port)
    port = needed_port(port)
    if not calibration.exists():
        hint = f"make one with: clutter6d teleop --device gello --port {port} --calibrate"
        raise MissingFileError("GELLO calibration", calibration, hint)
    return GelloDevice(port, read_model(calibration, GelloCalibration, what="GELLO calibration"))


def needed_port(port: Path | None) -> Path:
    """A GELLO's port.

    Raises:
        InvalidValueError: It was not given.
    """
    if port is None:
        raise InvalidValueError("a GELLO needs its serial port, for instance --port /dev/ttyUSB0")
    return port
