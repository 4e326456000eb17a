"""Running many tasks in processes that may die."""

import pytest

from clutter6d.errors import InvalidValueError
from clutter6d.executor import TaskLimits, map_tasks
from tests.assets.misbehaving_source import KINDS, misbehave, square


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
