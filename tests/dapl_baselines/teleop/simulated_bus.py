"""Dynamixel motors on a pseudo-terminal that speak protocol 2.0 byte by byte, and the faults that cables have."""

import contextlib
import os
import pty
import select
import struct
import threading
import tty
from pathlib import Path

import numpy as np

PING, READ, SYNC_READ, STATUS = 0x01, 0x02, 0x82, 0x55
_HEADER = b"\xff\xff\xfd\x00"
_PRESENT_POSITION = 132


def crc16(content: bytes) -> int:
    """CRC-16 with the polynomial 0x8005, most significant bit first, as protocol 2.0 defines it."""
    crc = 0
    for byte in content:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ 0x8005 if crc & 0x8000 else crc << 1
    return crc & 0xFFFF


def packet(motor: int, instruction: int, body: bytes) -> bytes:
    """A packet of protocol 2.0, its body stuffed."""
    stuffed = (bytes([instruction]) + body).replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
    content = _HEADER + bytes([motor]) + struct.pack("<H", len(stuffed) + 2) + stuffed
    return content + struct.pack("<H", crc16(content))


class SimulatedBus:
    """Motors 1 to 7, or others, in a thread of their own.

    Attributes:
        ticks: Present position of each motor.
        silent: Motors that do not answer.
        corrupt: Answers, from now on, whose CRC is wrong.
        swallow: Answers, from now on, that lose their third byte.
        noise: Bytes that come before every answer.
        written: Instructions other than those that only read.
    """

    def __init__(self, ids=range(1, 8)) -> None:
        self.ticks = dict.fromkeys(ids, 0)
        self.silent: set[int] = set()
        self.corrupt = self.swallow = 0
        self.noise = b""
        self.written: list[bytes] = []
        self._master, self._slave = pty.openpty()
        tty.setraw(self._master)
        tty.setraw(self._slave)
        self.port = Path(os.ttyname(self._slave))
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def __enter__(self) -> "SimulatedBus":
        return self

    def __exit__(self, *error) -> None:
        self.unplug()

    def set_angles(self, angles_rad) -> None:
        """Turn the motors to angles [rad]."""
        for motor, angle in zip(self.ticks, np.asarray(angles_rad), strict=True):
            self.ticks[motor] = round(angle * 4096 / (2 * np.pi))

    def unplug(self) -> None:
        """Pull the cable: whoever has the port open meets the end of the file."""
        if self._is_over.is_set():
            return
        self._is_over.set()
        self._thread.join()
        os.close(self._slave)
        os.close(self._master)

    def _run(self) -> None:
        waiting = b""
        while not self._is_over.is_set():
            if select.select([self._master], [], [], 0.02)[0]:
                with contextlib.suppress(OSError):
                    waiting = self._serve(waiting + os.read(self._master, 4096))

    def _serve(self, waiting: bytes) -> bytes:
        """Answer every whole instruction; returns what is left."""
        while (start := waiting.find(_HEADER)) >= 0:
            waiting = waiting[start:]
            size = 7 + int.from_bytes(waiting[5:7], "little") if len(waiting) >= 7 else 7
            if len(waiting) < max(size, 7):
                break
            whole, waiting = waiting[:size], waiting[size:]
            if crc16(whole[:-2]) == int.from_bytes(whole[-2:], "little"):
                self._answer(whole[4], whole[7], whole[8:-2])
        return waiting

    def _answer(self, motor: int, instruction: int, body: bytes) -> None:
        if instruction == PING:
            self._send(motor, struct.pack("<HB", 1190, 52))
        elif instruction == SYNC_READ and body[:4] == struct.pack("<HH", _PRESENT_POSITION, 4):
            for each in body[4:]:
                self._send(each, struct.pack("<i", self.ticks.get(each, 0)))
        else:
            self.written.append(bytes([motor, instruction]) + body)

    def _send(self, motor: int, body: bytes) -> None:
        if motor not in self.ticks or motor in self.silent:
            return
        content = packet(motor, STATUS, b"\x00" + body)
        if self.corrupt:
            self.corrupt -= 1
            content = content[:-1] + bytes([content[-1] ^ 0x5A])
        if self.swallow:
            self.swallow -= 1
            content = content[:2] + content[3:]
        os.write(self._master, self.noise + content)
