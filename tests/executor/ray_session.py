"""One Ray, several uses of it, in a process of its own: prints as JSON what became of each.

Ray keeps threads and state in the process that starts it, and cannot start after CoACD was loaded; so the tests look at
it from outside. A whole session takes about as long as starting Ray.
"""

import contextlib
import json
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil

from clutter6d.errors import Clutter6DError
from clutter6d.executor import TaskLimits, TaskResult, map_tasks, parse_executor
from tests.assets.misbehaving_source import KINDS, misbehave, square
from tests.executor.counted import Counted, KillsItsWorker, read_log, unpicklable

RAY = parse_executor("ray")


def plain(results: Iterator[TaskResult[Any, Any]]) -> list[list[Any]]:
    return [
        [result.item, result.value, result.failure and result.failure.kind, result.failure and result.failure.detail]
        for result in results
    ]


def kill_an_actor(log: Path) -> None:
    """Once one item is done and another has just begun."""
    while True:
        events = read_log(log) if log.exists() else []
        if len(events) >= 3 and events[-1][0] == "start":
            os.kill(events[-1][3], signal.SIGKILL)
            return
        time.sleep(0.01)


def with_a_killed_actor(folder: Path) -> dict[str, Any]:
    task = Counted(folder / "counted", seconds=1.0)
    threading.Thread(target=kill_an_actor, args=(task.log,), daemon=True).start()
    return {"results": plain(map_tasks(task, range(8), workers=2, executor=RAY)), "log": read_log(task.log)}


def not_importable(item: int) -> int:
    return item


def refusal_of_an_unknown_function() -> str:
    try:
        list(map_tasks(not_importable, [1], executor=RAY))
    except Clutter6DError as error:
        return str(error)
    return ""


def main(folder: Path) -> dict[str, Any]:
    always, limits = KillsItsWorker(folder / "always", times=99), TaskLimits(seconds=2, memory_bytes=4 << 30)
    parent = KillsItsWorker(folder / "parent", times=1, whom="parent")
    return {
        "squares": plain(map_tasks(square, range(20), workers=2, executor=RAY)),
        "misbehaving": plain(map_tasks(misbehave, KINDS, workers=2, limits=limits, executor=RAY)),
        "killed": with_a_killed_actor(folder),
        "always": plain(map_tasks(always, ["victim", "bystander"], workers=1, executor=RAY)),
        "parent": plain(map_tasks(parent, ["victim", "bystander"], workers=1, executor=RAY)),
        "unpicklable": plain(map_tasks(unpicklable, [1], executor=RAY)),
        "not_importable": refusal_of_an_unknown_function(),
        "listening": listening(),
    }


def listening() -> list[str]:
    """Addresses on which this session's processes listen."""
    found: set[str] = set()
    for process in (psutil.Process(), *psutil.Process().children(recursive=True)):
        with contextlib.suppress(psutil.NoSuchProcess):
            connections = process.net_connections(kind="inet")
            found |= {item.laddr.ip for item in connections if item.status == psutil.CONN_LISTEN}
    return sorted(found)


if __name__ == "__main__":
    report = main(Path(sys.argv[1]))
    sys.stdout.write("REPORT " + json.dumps(report) + "\n")
