"""Tasks that leave a line in a file when they start and when they end, so that what was done twice can be counted."""

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Counted:
    """Returns the square of its item after a while.

    Attributes:
        log: File of one line an event: what, item, process, parent process.
        seconds: How long an item takes.
    """

    log: Path
    seconds: float

    def __call__(self, item: int) -> int:
        self._write("start", item)
        time.sleep(self.seconds)
        self._write("end", item)
        return item * item

    def _write(self, what: str, item: int) -> None:
        with self.log.open("a") as file:
            file.write(f"{what} {item} {os.getpid()} {os.getppid()}\n")


@dataclass(frozen=True)
class KillsItsWorker:
    """Kills the process it runs in, or that one's parent, the first so many times that it is called.

    Attributes:
        log: File of one byte a call.
        times: How often it kills.
        whom: ``"worker"`` or ``"parent"``.
    """

    log: Path
    times: int
    whom: str = "worker"

    def __call__(self, item: str) -> str:
        calls = self.log.stat().st_size if self.log.exists() else 0
        with self.log.open("a") as file:
            file.write(".")
        if item == "victim" and calls < self.times:
            os.kill(os.getpid() if self.whom == "worker" else os.getppid(), signal.SIGKILL)
            time.sleep(60)
        return item


def read_log(log: Path) -> list[tuple[str, int, int, int]]:
    """What happened: start or end, item, process, its parent."""
    lines = (line.split() for line in log.read_text().splitlines())
    return [(what, int(item), int(process), int(parent)) for what, item, process, parent in lines]


def unpicklable(item: int) -> object:
    """A value that no other process can be sent."""
    return lambda: item
