"""Angles of Dynamixel motors on one serial bus (protocol 2.0), by one sync read; nothing is ever written to a motor."""

import termios
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64

from clutter6d.errors import MissingDependencyError
from dapl_baselines.teleop.device import DeviceLostError

TICKS_PER_TURN = 4096
"""Of the X series (XL330, XC330), which GELLO is built from."""
PRESENT_POSITION, POSITION_BYTES = 132, 4
"""Address and size in the X series' control table."""


class DynamixelBus:
    """Motors on a serial port.

    Args:
        port: The port's device file.
        ids: Their ids.
        baud_rate: Bits a second that all of them are set to.
    """

    def __init__(self, port: Path, ids: Sequence[int], baud_rate: int) -> None:
        self._path, self._ids, self._baud_rate = port, tuple(ids), baud_rate
        self._sdk: Any = None
        self._port: Any = None
        self._sync_read: Any = None

    def open(self) -> None:
        """Open the port.

        Raises:
            DeviceLostError: It is not there, or may not be opened.
            MissingDependencyError: dynamixel-sdk is not installed.
        """
        self.close()
        self._sdk = _import_sdk()
        self._port = self._sdk.PortHandler(str(self._path))
        try:
            is_known = self._port.setBaudRate(self._baud_rate)
        except (OSError, ValueError, termios.error) as error:
            self._port = None
            why = _reason(error)
            raise DeviceLostError(
                f"serial port {self._path}: {why}; docs/teleoperate.md says how to allow it"
            ) from None
        if not is_known:
            self._port = None
            raise DeviceLostError(f"serial port {self._path}: no such baud rate: {self._baud_rate}")
        handler = self._sdk.PacketHandler(2.0)
        self._sync_read = self._sdk.GroupSyncRead(self._port, handler, PRESENT_POSITION, POSITION_BYTES)
        for motor in self._ids:
            self._sync_read.addParam(motor)

    def angles(self) -> Float64[np.ndarray, "motor"]:
        """Angle of each motor [rad], by its own zero and direction; asks a second time if a packet was damaged.

        Raises:
            DeviceLostError: A motor does not answer, or the port is gone.
        """
        if self._port is None:
            raise DeviceLostError(f"serial port {self._path} is not open; plug it in again")
        try:
            for _ in range(2):
                self._port.clearPort()
                if self._sync_read.txRxPacket() == self._sdk.COMM_SUCCESS:
                    return self._positions()
            raise DeviceLostError(self._diagnosis())
        except (OSError, termios.error) as error:
            raise DeviceLostError(f"serial port {self._path} is gone ({_reason(error)}); plug it in again") from None

    def close(self) -> None:
        """Close the port."""
        if self._port is not None:
            self._port.closePort()
            self._port = None

    def _positions(self) -> Float64[np.ndarray, "motor"]:
        raw = [self._sync_read.getData(motor, PRESENT_POSITION, POSITION_BYTES) for motor in self._ids]
        ticks = np.array(raw, dtype=np.uint32).astype(np.int32)
        return ticks * (2 * np.pi / TICKS_PER_TURN)

    def _diagnosis(self) -> str:
        """Which motors are silent, asked one by one."""
        handler = self._sdk.PacketHandler(2.0)
        silent = [motor for motor in self._ids if handler.ping(self._port, motor)[1] != self._sdk.COMM_SUCCESS]
        if len(silent) == len(self._ids):
            return (
                f"no motor answers on {self._path} at {self._baud_rate} baud; is it powered, and the baud rate right?"
            )
        if silent:
            names = ", ".join(str(motor) for motor in silent)
            return f"motor {names} on {self._path} does not answer; look at its cable"
        return f"damaged packets on {self._path}; look at its cables"


def _import_sdk() -> Any:
    try:
        import dynamixel_sdk
    except ImportError:
        raise MissingDependencyError('GELLO needs dynamixel-sdk; run: pip install "clutter6d[teleop]"') from None
    return dynamixel_sdk


def _reason(error: Exception) -> str:
    return (getattr(error, "strerror", None) or str(error) or type(error).__name__).splitlines()[0]
