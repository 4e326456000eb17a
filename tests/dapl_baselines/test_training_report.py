"""What trainings share: where they stand, and how a command follows them."""

import time
from dataclasses import asdict

import pytest

from dapl_baselines.training_report import Standing, until


def test_a_standing_comes_back_from_a_state_with_other_things_in_it() -> None:
    standing = Standing(iteration=3, seconds=1.5, best_success=0.25)
    assert Standing.of_state({"format": "any", **asdict(standing)}) == standing
    with pytest.raises(KeyError):
        Standing.of_state({"iteration": 3})


def test_without_a_limit_all_reports_come_and_after_it_none() -> None:
    reports = [object(), object(), object()]
    assert list(until(iter(reports), None)) == reports
    assert list(until(iter(reports), 0.0)) == reports[:1]


def test_the_limit_is_in_minutes(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 59.0, 61.0, 1000.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    assert len(list(until(iter([object()] * 5), 1.0))) == 2
