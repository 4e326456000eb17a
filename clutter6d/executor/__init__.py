"""Running one function over many items in workers that may die without taking anything with them.

The items' results come back in the order in which they finish, and are the same wherever and by however many workers
they were made. A worker that crashes, exceeds its memory or its time is replaced, and its item reported as failed; the
others go on. A worker that is killed from outside (by SIGKILL or SIGTERM, or with its whole machine) is replaced too,
and its item given to another, three times at most.
"""

import time
from collections.abc import Callable, Iterator, Sequence

from clutter6d.errors import InvalidValueError
from clutter6d.executor.child import announce_stage, attempt
from clutter6d.executor.choice import EXECUTOR_HELP, LOCAL, Executor, parse_executor
from clutter6d.executor.local import map_locally
from clutter6d.executor.tasks import Item, Result, TaskFailure, TaskLimits, TaskResult
from clutter6d.executor.wire import encode

__all__ = [
    "EXECUTOR_HELP",
    "LOCAL",
    "Executor",
    "TaskFailure",
    "TaskLimits",
    "TaskResult",
    "announce_stage",
    "map_tasks",
    "parse_executor",
]


def map_tasks(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    workers: int = 1,
    limits: TaskLimits | None = None,
    executor: Executor = LOCAL,
) -> Iterator[TaskResult[Item, Result]]:
    """Apply a function to every item, in worker processes, and yield each result as it finishes.

    A worker receives the function once and keeps what it loads between items. At most one item is with each worker,
    and one finished result waits for the caller; so nothing piles up however slowly results are taken. Locally, one
    worker without limits is this process itself.

    Args:
        function: A function or other picklable callable of a module that workers can import; it may call
            ``announce_stage``.
        items: Picklable items.
        workers: Worker processes; on a cluster as many of them as there are free CPUs work at once.
        limits: Time and memory of one item; with limits, even one local worker is a process of its own.
        executor: Where the workers are.

    Yields:
        One result per item.

    Raises:
        InvalidValueError: There is not at least one worker; no cluster answers at the executor's address; or workers
            cannot import the function, or have other versions of the libraries that results depend on.
    """
    if workers < 1:
        raise InvalidValueError(f"workers is {workers}; at least 1 is needed")
    if not items:
        return
    if executor.kind == "ray":
        from clutter6d.executor.ray_driver import map_on_ray

        yield from map_on_ray(encode(function), items, workers, limits or TaskLimits(), executor.address)
    elif workers == 1 and limits is None:
        yield from _map_here(function, items)
    else:
        yield from map_locally(encode(function), items, workers, limits or TaskLimits())


def _map_here(function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[TaskResult[Item, Result]]:
    for index, item in enumerate(items):
        start = time.monotonic()
        value, failure = attempt(function, item)
        yield TaskResult(index=index, item=item, value=value, failure=failure, seconds=time.monotonic() - start)
