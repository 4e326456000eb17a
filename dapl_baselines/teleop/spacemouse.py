"""Driving by a 3Dconnexion SpaceMouse, read from Linux's raw HID device: a file of reports, no package needed.

Report 1 holds the translation, and on newer models the rotation too; report 2 the rotation of older ones; report 3 the
buttons. Values are signed 16-bit, about -350 to 350, in a frame of the device: right, towards the person, down. A cap
off its centre is reported again and again, so silence means that it is at rest or that the link is dead; either way the
arm stands.
"""

import errno
import os
import struct
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from dapl_baselines.teleop.device import Command, DeviceLostError, Wish

FULL_SCALE = 350
DEAD_BAND = 0.08
SILENCE_S = 0.3
CONNEXION, LOGITECH = 0x256F, 0x046D
LOGITECH_PRODUCTS = (0xC621, 0xC623, 0xC625, 0xC626, 0xC627, 0xC628, 0xC629, 0xC62B)
"""3Dconnexion's products were sold under Logitech's number once."""
_TRANSLATION, _ROTATION, _BUTTONS = 1, 2, 3
_MAX_REPORT_BYTES = 64
_WISHES: tuple[Wish, ...] = ("toggle", "give_up")
_SYSTEM = Path("/sys/class/hidraw")


class SpaceMouseDevice:
    """A SpaceMouse of any model.

    Args:
        port: Its device file; by default the first one that is plugged in.
        clock: Seconds that only grow.
    """

    name = "spacemouse"
    settings: Mapping[str, object] = {"full_scale": FULL_SCALE, "dead_band": DEAD_BAND}
    help_lines = (
        "push, lift\tmove the finger tips, as you face the robot",
        "tilt, twist\tturn the hand about them",
        "left button\tstart, pause, go on",
        "right button\tgive up, twice",
    )

    def __init__(self, port: Path | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._port, self._clock = port, clock
        self._file: int | None = None
        self._forget()

    def connect(self) -> None:
        """Open the device's file."""
        self.close()
        port = self._port or find_space_mouse()
        try:
            self._file = os.open(port, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise DeviceLostError(
                f"SpaceMouse at {port}: {error.strerror}; docs/teleoperate.md says how to allow it"
            ) from None
        self._forget()

    def read(self, keys: Sequence[str]) -> Command:  # noqa: ARG002  it has buttons of its own
        """The cap's deflection as last reported, and the buttons that were pressed."""
        wishes: list[Wish] = []
        for report in self._reports():
            wishes += self._take(report)
        if self._clock() - self._heard > SILENCE_S:
            self._raw[:] = 0
        return Command(deflection=to_deflection(self._raw), wishes=tuple(wishes))

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _forget(self) -> None:
        self._raw, self._pressed, self._heard = np.zeros(6), 0, self._clock()

    def _reports(self) -> list[bytes]:
        """Every report that waits."""
        found: list[bytes] = []
        while True:
            try:
                report = os.read(self._open_file(), _MAX_REPORT_BYTES)
            except BlockingIOError:
                return found
            except OSError as error:
                report, why = b"", os.strerror(error.errno or errno.EIO)
            else:
                why = "it was unplugged"
            if not report:
                raise DeviceLostError(f"the SpaceMouse is gone ({why}); plug it in again")
            found.append(report)

    def _open_file(self) -> int:
        if self._file is None:
            raise DeviceLostError("the SpaceMouse is not open; plug it in again")
        return self._file

    def _take(self, report: bytes) -> list[Wish]:
        """Remember what a report says; returns the wishes of newly pressed buttons."""
        kind, body = report[0], report[1:]
        if kind == _TRANSLATION and len(body) >= 12:
            self._raw[:] = struct.unpack_from("<6h", body)
        elif kind in (_TRANSLATION, _ROTATION) and len(body) >= 6:
            self._raw[3 * (kind - 1) : 3 * kind] = struct.unpack_from("<3h", body)
        elif kind == _BUTTONS and body:
            pressed, self._pressed = body[0] & ~self._pressed, body[0]
            return [wish for bit, wish in enumerate(_WISHES) if pressed >> bit & 1]
        else:
            return []
        self._heard = self._clock()
        return []


def to_deflection(raw: Float64[np.ndarray, "6"]) -> Float64[np.ndarray, "6"]:
    """Raw values as a deflection in the person's axes."""
    share = np.clip(raw / FULL_SCALE, -1.0, 1.0)
    share = np.sign(share) * np.maximum(np.abs(share) - DEAD_BAND, 0.0) / (1 - DEAD_BAND)
    return -share[[1, 0, 2, 4, 3, 5]]


def find_space_mouse(system: Path = _SYSTEM) -> Path:
    """The device file of the first SpaceMouse.

    Args:
        system: Where the kernel lists raw HID devices.

    Raises:
        DeviceLostError: None is plugged in.
    """
    for entry in sorted(system.glob("hidraw*/device/uevent")):
        named = [line.removeprefix("HID_ID=") for line in entry.read_text().splitlines() if line.startswith("HID_ID=")]
        _, vendor, product = (int(part, 16) for part in (named or ["0:0:0"])[0].split(":"))
        if vendor == CONNEXION or (vendor == LOGITECH and product in LOGITECH_PRODUCTS):
            return Path("/dev") / entry.parts[-3]
    raise DeviceLostError("no SpaceMouse is plugged in; name its device file by --port /dev/hidrawN")
