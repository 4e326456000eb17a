"""Waiting for several answers at once."""

import queue
import threading
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

Item = TypeVar("Item")
Value = TypeVar("Value")


def map_threads(
    function: Callable[[Item], Value], items: Iterable[Item], threads: int
) -> Iterator[tuple[Item, Value | BaseException]]:
    """Apply a function that mostly waits, and yield each item with its result as it comes.

    Items are taken from their iterator in the calling thread, at most one a thread ahead of the results. Threads are
    daemons: an interrupt of the caller does not wait for them.

    Args:
        function: Called in the threads; what it raises becomes its result.
        items: May be lazy.
        threads: How many.
    """
    tasks: queue.SimpleQueue[tuple[Item] | None] = queue.SimpleQueue()
    results: queue.SimpleQueue[tuple[Item, Value | BaseException]] = queue.SimpleQueue()

    def work() -> None:
        while (task := tasks.get()) is not None:
            try:
                results.put((task[0], function(task[0])))
            except BaseException as error:  # noqa: BLE001 - it is raised again where the result is taken
                results.put((task[0], error))

    for _ in range(threads):
        threading.Thread(target=work, daemon=True).start()
    waiting = 0
    try:
        for item in items:
            tasks.put((item,))
            waiting += 1
            while waiting > threads or (waiting and not results.empty()):
                yield results.get()
                waiting -= 1
        for _ in range(waiting):
            yield results.get()
    finally:
        for _ in range(threads):
            tasks.put(None)
