"""The worker process: receives a function once, then item after item, and ends with the process that started it."""

import logging
import multiprocessing
import os
import resource
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection

from clutter6d.errors import Clutter6DError
from clutter6d.executor.tasks import Item, Result, TaskFailure
from clutter6d.executor.wire import Payload, decode, encode

_log = logging.getLogger(__name__)
_stage_connection: Connection | None = None


def announce_stage(stage: str) -> None:
    """Tell the parent what this task does now, so that a death can be blamed on it; does nothing elsewhere."""
    if _stage_connection is not None:
        _stage_connection.send(("stage", stage))


def attempt(function: Callable[[Item], Result], item: Item) -> tuple[Result | None, TaskFailure | None]:
    """Call the function; every exception becomes a failure, since one bad item must not end the run."""
    try:
        return function(item), None
    except Clutter6DError as error:
        return None, TaskFailure(kind="error", stage="", detail=str(error), error=error)
    except MemoryError:
        return None, TaskFailure(kind="memory", stage="", detail="out of memory")
    except Exception as error:  # noqa: BLE001  third-party code raises anything on bad input
        _log.debug("task failed", exc_info=True)
        return None, TaskFailure(kind="error", stage="", detail=_one_line(error))


def serve(connection: Connection, memory_bytes: int | None) -> None:
    """The child's loop: receive the function, then an item, send its result, until the pipe closes.

    Sends ``("ready",)`` or ``("unfit", why)`` once, ``("stage", name)`` at any time, ``("done", payload)`` per item.
    """
    global _stage_connection
    _stage_connection = connection
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if memory_bytes is not None:
        resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes))
    with suppress(EOFError, OSError):  # the parent is gone
        try:
            function = decode(connection.recv_bytes())
        except Exception as error:  # noqa: BLE001  unpickling imports modules, which raise anything
            connection.send(("unfit", _one_line(error)))
            return
        connection.send(("ready",))
        while True:
            connection.send(("done", _perform(function, connection.recv_bytes())))


def _perform(function: Callable[[object], object], item: Payload) -> Payload:
    value, failure = attempt(lambda payload: function(decode(payload)), item)
    try:
        return encode((value, failure))
    except Exception as error:  # noqa: BLE001  any object may refuse to be pickled, with any exception
        failure = TaskFailure(kind="error", stage="", detail=f"its result cannot be sent: {_one_line(error)}")
        return encode((None, failure))


def _end_with_parent() -> None:
    """Die when the parent does, even in the middle of an item: nobody is left to take its result."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGKILL)


def _one_line(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0][:300]
