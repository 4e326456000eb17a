"""A real server process on a free loopback port."""

import re
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

WAIT_S = 120


@dataclass(frozen=True, slots=True)
class RunningServer:
    """A process that listens."""

    process: subprocess.Popen
    port: int

    def stop(self, number: int = signal.SIGINT) -> tuple[int, str]:
        """Send a signal; returns the exit code and what was still printed."""
        self.process.send_signal(number)
        out, _ = self.process.communicate(timeout=WAIT_S)
        return self.process.returncode, out


@contextmanager
def running(*command: str, port: int = 0) -> Iterator[RunningServer]:
    """Start ``dapl serve`` and wait until it listens; it is killed in the end."""
    process = subprocess.Popen(
        [*command, "--port", str(port)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        line = process.stdout.readline()
        found = re.search(r"ws://127\.0\.0\.1:(\d+)", line)
        assert found, line + process.communicate(timeout=WAIT_S)[0]
        yield RunningServer(process, int(found[1]))
    finally:
        process.kill()
        process.communicate(timeout=WAIT_S)
