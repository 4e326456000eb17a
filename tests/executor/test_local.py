"""Running many tasks in processes that may die."""

import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from clutter6d.errors import InvalidValueError
from clutter6d.executor import TaskLimits, map_tasks
from tests.assets.misbehaving_source import KINDS, misbehave, square
from tests.executor.counted import Counted, KillsItsWorker, read_log, unpicklable

ROOT = Path(__file__).resolve().parents[2]
PARENT = """
import pathlib, sys
from clutter6d.executor import map_tasks
from tests.executor.counted import Counted
list(map_tasks(Counted(pathlib.Path(sys.argv[1]), seconds=30), range(2), workers=2))
"""


@pytest.mark.parametrize("workers", [1, 2])
def test_every_item_has_one_result(workers: int) -> None:
    results = list(map_tasks(square, range(7), workers=workers))
    assert sorted(result.index for result in results) == list(range(7))
    assert all(result.value == result.item**2 and result.failure is None for result in results)


def test_no_items_give_no_results() -> None:
    assert list(map_tasks(square, [], workers=2)) == []


def test_a_task_that_dies_takes_nothing_with_it() -> None:
    limits = TaskLimits(seconds=2, memory_bytes=4 << 30)
    results = {result.item: result for result in map_tasks(misbehave, KINDS, workers=1, limits=limits)}
    kinds = {item: result.failure and result.failure.kind for item, result in results.items()}
    assert kinds == {"good": None, "aborts": "crash", "hangs": "timeout", "eats-memory": "memory", "raises": "error"}
    assert results["good"].value == "good"
    assert "ZeroDivisionError: in the loader" in str(results["raises"].failure)


def test_an_error_in_this_process_is_a_failure_too() -> None:
    result = next(map_tasks(misbehave, ["raises"]))
    assert result.failure is not None
    assert result.failure.kind == "error"


def test_at_least_one_worker_is_needed() -> None:
    with pytest.raises(InvalidValueError, match="workers"):
        next(map_tasks(square, [1], workers=0))


def test_an_item_whose_worker_was_killed_is_given_to_another(tmp_path: Path) -> None:
    task, items = KillsItsWorker(tmp_path / "calls", times=2), ["victim", "bystander"]
    results = list(map_tasks(task, items, workers=1, limits=TaskLimits()))
    assert [(result.item, result.value, result.failure) for result in results] == [
        ("victim", "victim", None), ("bystander", "bystander", None),
    ]  # fmt: skip


def test_an_item_whose_workers_are_killed_again_and_again_is_a_crash(tmp_path: Path) -> None:
    task, items = KillsItsWorker(tmp_path / "calls", times=9), ["victim", "bystander"]
    results = {result.item: result for result in map_tasks(task, items, workers=1, limits=TaskLimits())}
    assert results["victim"].failure is not None
    assert (results["victim"].failure.kind, results["victim"].failure.detail) == ("crash", "exit code -9")
    assert results["bystander"].value == "bystander"
    assert (tmp_path / "calls").stat().st_size == 3 + 1


def test_a_result_that_cannot_be_sent_is_an_error() -> None:
    result = next(map_tasks(unpicklable, [1], limits=TaskLimits()))
    assert result.failure is not None
    assert result.failure.kind == "error"
    assert "cannot be sent" in result.failure.detail


def test_a_caller_that_takes_its_time_holds_the_workers_back(tmp_path: Path) -> None:
    task = Counted(tmp_path / "log", seconds=0.0)
    results = map_tasks(task, range(50), workers=2)
    next(results)
    time.sleep(0.5)
    assert len(read_log(task.log)) <= 2 * (1 + 2 + 2)  # one taken, one waiting and one running with each worker
    assert len(list(results)) == 49


def test_a_caller_that_stops_early_stops_the_workers(tmp_path: Path) -> None:
    task = Counted(tmp_path / "log", seconds=0.2)
    results = map_tasks(task, range(50), workers=2)
    next(results)
    results.close()  # type: ignore[attr-defined]
    assert not [process for _, _, process, _ in read_log(task.log) if psutil.pid_exists(process)]


def test_workers_end_with_their_parent(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with subprocess.Popen([sys.executable, "-c", PARENT, str(log)], cwd=ROOT) as parent:
        _wait_until(lambda: log.exists() and len(read_log(log)) == 2)
        parent.kill()
    _wait_until(lambda: not any(psutil.pid_exists(process) for _, _, process, _ in read_log(log)))


def _wait_until(is_so) -> None:
    deadline = time.monotonic() + 60
    while not is_so():
        assert time.monotonic() < deadline
        time.sleep(0.05)
