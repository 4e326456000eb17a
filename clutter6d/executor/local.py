"""Tasks in processes of this machine."""

from collections.abc import Iterator, Sequence
from multiprocessing.connection import wait
from typing import Any

from clutter6d.executor.task_queue import TaskQueue
from clutter6d.executor.tasks import TaskLimits, TaskResult
from clutter6d.executor.wire import Payload, encode
from clutter6d.executor.worker import Worker


def map_locally(
    function: Payload, items: Sequence[Any], workers: int, limits: TaskLimits
) -> Iterator[TaskResult[Any, Any]]:
    """Yield each item's result as it finishes; a free worker gets its next item before the caller sees the result."""
    queue, pool = TaskQueue(items), [Worker(function, limits) for _ in range(min(workers, len(items)))]
    try:
        for worker in pool:
            _feed(worker, queue)
        while busy := [worker for worker in pool if worker.index is not None]:
            wait([worker.connection for worker in busy], timeout=min(worker.seconds_left() for worker in busy))
            for worker in busy:
                index, outcome = worker.index, worker.poll()
                if index is None or outcome is None:
                    continue
                result = queue.settle(index, outcome)
                _feed(worker, queue)
                if result is not None:
                    yield result
    finally:
        for worker in pool:
            worker.stop()


def _feed(worker: Worker, queue: TaskQueue[Any]) -> None:
    if queue:
        index, item = queue.take()
        worker.start(index, encode(item))
