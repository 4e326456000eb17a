"""One worker process seen from outside: it may die or exceed its limits, and is then replaced."""

import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import wait

import psutil

from clutter6d.errors import InvalidValueError
from clutter6d.executor.child import serve
from clutter6d.executor.task_queue import Outcome
from clutter6d.executor.tasks import FailureKind, TaskFailure, TaskLimits
from clutter6d.executor.wire import Payload

_SINGLE_THREADED = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_FROM_OUTSIDE = (-signal.SIGKILL, -signal.SIGTERM)
_LONGEST_WAIT_S = 60.0
_PATIENCE = 10.0


class Worker:
    """One child process; a dead one is replaced when the next item starts.

    Args:
        function: What it applies, encoded.
        limits: Of each item.
    """

    def __init__(self, function: Payload, limits: TaskLimits) -> None:
        self._function, self._limits = function, limits
        self.index: int | None = None
        self._spawn()

    def _spawn(self) -> None:
        context = get_context("spawn")
        self.connection, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs, self._limits.memory_bytes), daemon=True)
        with _single_threaded(), _deaf_to_interrupts():
            self._process.start()
        theirs.close()
        self._is_ready = False
        with suppress(OSError):  # a child that died already is seen by poll
            self.connection.send_bytes(self._function)

    def start(self, index: int, item: Payload) -> None:
        """Give it an item; it must have none."""
        if not self._process.is_alive():
            self._spawn()
        self.index, self._stage = index, ""
        self._begin(is_ready=self._is_ready)
        with suppress(OSError):  # a child that died already is seen by poll
            self.connection.send_bytes(item)

    def _begin(self, *, is_ready: bool = True) -> None:
        self._is_ready, self._started, self._used_before = is_ready, time.monotonic(), self._processor_seconds()

    def wait(self) -> Outcome:
        """The item's outcome, as soon as there is one."""
        while True:
            wait([self.connection], timeout=self.seconds_left())
            outcome = self.poll()
            if outcome is not None:
                return outcome

    def seconds_left(self) -> float:
        """How long there is surely nothing to do for the parent, at most a minute."""
        limit = self._limits.seconds
        if limit is None or not self._is_ready:
            return _LONGEST_WAIT_S
        elapsed = time.monotonic() - self._started
        if elapsed < limit:  # one thread cannot have used more than that, and asking the system costs time
            return min(limit - elapsed, _LONGEST_WAIT_S)
        used = max(self._processor_seconds() - self._used_before, elapsed / _PATIENCE)
        return min(max(limit - used, 0.0), _LONGEST_WAIT_S)

    def _processor_seconds(self) -> float:
        try:
            times = psutil.Process(self._process.pid).cpu_times()
        except psutil.NoSuchProcess:
            return 0.0
        return float(times.user + times.system)

    def poll(self) -> Outcome | None:
        """The finished item's outcome, or ``None`` while it runs.

        Raises:
            InvalidValueError: The child cannot import what the function is made of.
        """
        try:
            while self.connection.poll():
                kind, *content = self.connection.recv()
                if kind == "ready":
                    self._begin()
                elif kind == "stage":
                    self._stage = content[0]
                elif kind == "unfit":
                    raise InvalidValueError(
                        f"a worker cannot load its task ({content[0]}); it must be in a module that workers can import"
                    )
                else:
                    return self._end(Outcome(payload=content[0], stage=self._stage, seconds=self._elapsed()))
        except (EOFError, OSError):
            self._process.join()
            return self._die("crash", f"exit code {self._process.exitcode}")
        if self._is_ready and self.seconds_left() <= 0:
            return self._die("timeout", f"more than {self._limits.seconds:g} s of processor time")
        return None

    def _die(self, kind: FailureKind, detail: str) -> Outcome:
        self.stop()
        is_lost = kind == "crash" and self._process.exitcode in _FROM_OUTSIDE
        failure = TaskFailure(kind=kind, stage=self._stage, detail=detail)
        return self._end(Outcome(failure=failure, stage=self._stage, seconds=self._elapsed(), is_lost=is_lost))

    def _end(self, outcome: Outcome) -> Outcome:
        self.index = None
        return outcome

    def _elapsed(self) -> float:
        return time.monotonic() - self._started

    def stop(self) -> None:
        """Kill the child, whatever it does."""
        self.connection.close()
        self._process.kill()
        self._process.join()


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Children inherit this mask: Ctrl-C reaches the parent alone, which stops them."""
    resource_tracker.ensure_running()  # or the first start would do it, and lift the mask
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Children inherit this environment: one thread per worker, and so results that do not depend on the machine."""
    before = {name: os.environ.get(name) for name in _SINGLE_THREADED}
    os.environ.update(dict.fromkeys(_SINGLE_THREADED, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
