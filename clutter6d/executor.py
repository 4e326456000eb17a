"""Running one function over many items in worker processes that may die without taking anything with them.

The items' results come back in the order in which they finish. A worker that crashes, exceeds its memory or its time
is replaced, and its item reported as failed; the others go on. With no limits and one worker, items run in this
process.
"""

import logging
import os
import resource
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, Literal, TypeVar

import psutil

from clutter6d.errors import Clutter6DError, InvalidValueError

Item = TypeVar("Item")
Result = TypeVar("Result")
FailureKind = Literal["crash", "timeout", "memory", "error"]

_log = logging.getLogger(__name__)
_SINGLE_THREADED = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_LONGEST_WAIT_S = 60.0
_PATIENCE = 10.0
_stage_connection: Connection | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class TaskFailure:
    """Why an item gave no result.

    Attributes:
        kind: ``crash`` (the process died), ``timeout``, ``memory``, or ``error`` (an exception, see ``error``).
        stage: The last stage that the function announced.
        detail: One line.
        error: The exception, if it is one of this package.
    """

    kind: FailureKind
    stage: str
    detail: str
    error: Clutter6DError | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class TaskResult(Generic[Item, Result]):
    """What became of one item: ``value`` if ``failure`` is ``None``."""

    index: int
    item: Item
    value: Result | None
    failure: TaskFailure | None
    seconds: float


@dataclass(frozen=True, kw_only=True, slots=True)
class TaskLimits:
    """What one item may use before its worker is replaced; ``None`` for no limit.

    Attributes:
        seconds: Processor time, so that a busy machine stops nothing; and a process that only waits is given up
            after ten times as long.
        memory_bytes: Address space.
    """

    seconds: float | None = None
    memory_bytes: int | None = None


def announce_stage(stage: str) -> None:
    """Tell the parent what this task does now, so that a death can be blamed on it; does nothing elsewhere."""
    if _stage_connection is not None:
        _stage_connection.send(("stage", stage))


def map_tasks(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    workers: int = 1,
    limits: TaskLimits | None = None,
) -> Iterator[TaskResult[Item, Result]]:
    """Apply a function to every item, in worker processes, and yield each result as it finishes.

    Args:
        function: A module-level function or other picklable callable; it may call ``announce_stage``.
        items: Picklable items.
        workers: Worker processes.
        limits: Time and memory of one item; with limits, even one worker is a process of its own.

    Yields:
        One result per item.

    Raises:
        InvalidValueError: There is not at least one worker.
    """
    if workers < 1:
        raise InvalidValueError(f"workers is {workers}; at least 1 is needed")
    if workers == 1 and limits is None:
        for index, item in enumerate(items):
            start = time.monotonic()
            yield _to_result(index, item, *_attempt(function, item), "", time.monotonic() - start)
        return
    yield from _map_in_processes(function, items, min(workers, max(len(items), 1)), limits or TaskLimits())


def _map_in_processes(
    function: Callable[[Item], Result], items: Sequence[Item], workers: int, limits: TaskLimits
) -> Iterator[TaskResult[Item, Result]]:
    waiting = deque(enumerate(items))
    pool = [_Worker(function, limits) for _ in range(workers)]
    try:
        while True:
            for worker in pool:
                if worker.is_idle and waiting:
                    worker.start(*waiting.popleft())
            busy = [worker for worker in pool if not worker.is_idle]
            if not busy:
                return
            wait([worker.connection for worker in busy], timeout=min(worker.seconds_left() for worker in busy))
            for worker in busy:
                result = worker.poll()
                if result is not None:
                    yield result
    finally:
        for worker in pool:
            worker.stop()


class _Worker:
    """One child process; a dead one is replaced when the next item starts."""

    def __init__(self, function: Callable[[Any], Any], limits: TaskLimits) -> None:
        self._function, self._limits = function, limits
        self._task: tuple[int, Any] | None = None
        self._spawn()

    def _spawn(self) -> None:
        context = get_context("spawn")
        self.connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, self._limits.memory_bytes), daemon=True)
        with _single_threaded(), _deaf_to_interrupts():
            self._process.start()
        theirs.close()
        self._is_new = True
        self._is_ready = False

    @property
    def is_idle(self) -> bool:
        return self._task is None

    def start(self, index: int, item: Any) -> None:
        if not self._process.is_alive():
            self._spawn()
        self._task, self._stage = (index, item), ""
        self._begin(is_ready=self._is_ready)
        with suppress(OSError):  # a child that died already is seen by poll
            if self._is_new:
                self.connection.send(self._function)
            self._is_new = False
            self.connection.send(item)

    def _begin(self, *, is_ready: bool = True) -> None:
        self._is_ready, self._started, self._used_before = is_ready, time.monotonic(), self._processor_seconds()

    def seconds_left(self) -> float:
        """How long there is surely nothing to do for the parent, at most a minute."""
        limit = self._limits.seconds
        if limit is None or not self._is_ready:
            return _LONGEST_WAIT_S
        used = max(self._processor_seconds() - self._used_before, (time.monotonic() - self._started) / _PATIENCE)
        return min(max(limit - used, 0.0), _LONGEST_WAIT_S)

    def _processor_seconds(self) -> float:
        try:
            times = psutil.Process(self._process.pid).cpu_times()
        except psutil.NoSuchProcess:
            return 0.0
        return float(times.user + times.system)

    def poll(self) -> TaskResult[Any, Any] | None:
        """The finished task's result, or ``None`` while it runs."""
        try:
            while self.connection.poll():
                kind, *content = self.connection.recv()
                if kind == "ready":
                    self._begin()
                elif kind == "stage":
                    self._stage = content[0]
                else:
                    return self._finish(*content)
        except (EOFError, OSError):
            self.stop()
            code = self._process.exitcode
            return self._finish(None, TaskFailure(kind="crash", stage=self._stage, detail=f"exit code {code}"))
        if self._is_ready and self.seconds_left() <= 0:
            self.stop()
            detail = f"more than {self._limits.seconds:g} s of processor time"
            return self._finish(None, TaskFailure(kind="timeout", stage=self._stage, detail=detail))
        return None

    def _finish(self, value: Any, failure: TaskFailure | None) -> TaskResult[Any, Any]:
        assert self._task is not None
        index, item = self._task
        self._task = None
        return _to_result(index, item, value, failure, self._stage, time.monotonic() - self._started)

    def stop(self) -> None:
        self.connection.close()
        self._process.kill()
        self._process.join()


def _to_result(
    index: int, item: Item, value: Result | None, failure: TaskFailure | None, stage: str, seconds: float
) -> TaskResult[Item, Result]:
    if failure is not None and not failure.stage and stage:
        failure = TaskFailure(kind=failure.kind, stage=stage, detail=failure.detail, error=failure.error)
    return TaskResult(index=index, item=item, value=value, failure=failure, seconds=seconds)


def _serve(connection: Connection, memory_bytes: int | None) -> None:
    """The child's loop: receive the function, then an item, send its result, until the pipe closes."""
    global _stage_connection
    _stage_connection = connection
    if memory_bytes is not None:
        resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes))
    function = connection.recv()
    with suppress(EOFError, OSError):  # the parent is gone
        connection.send(("ready",))
        while True:
            connection.send(("done", *_attempt(function, connection.recv())))


def _attempt(function: Callable[[Item], Result], item: Item) -> tuple[Result | None, TaskFailure | None]:
    """Call the function; every exception becomes a failure, since one bad item must not end the run."""
    try:
        return function(item), None
    except Clutter6DError as error:
        return None, TaskFailure(kind="error", stage="", detail=str(error), error=error)
    except MemoryError:
        return None, TaskFailure(kind="memory", stage="", detail="out of memory")
    except Exception as error:  # noqa: BLE001  third-party code raises anything on bad input
        _log.debug("task failed", exc_info=True)
        return None, TaskFailure(
            kind="error", stage="", detail=f"{type(error).__name__}: {error}".splitlines()[0][:300]
        )


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
