import pytest

from dapl_baselines.teleop.pace import Pace


class Time:
    """A clock that sleeping moves."""

    def __init__(self) -> None:
        self.now = 0.0
        self.ticks: list[float] = []

    def sleep(self, seconds: float) -> None:
        self.now += seconds


def run(time: Time, pace: Pace, works: list[float]) -> None:
    for work in works:
        pace.wait()
        time.ticks.append(time.now)
        time.now += work


def test_steps_are_a_tenth_of_a_second_apart_however_long_the_work_takes():
    time = Time()
    run(time, Pace(lambda: time.now, time.sleep), [0.01, 0.09, 0.05, 0.0])
    assert time.ticks == pytest.approx([0.0, 0.1, 0.2, 0.3])


def test_time_that_was_lost_is_not_caught_up():
    time = Time()
    run(time, Pace(lambda: time.now, time.sleep), [0.01, 5.0, 0.01, 0.01])
    assert time.ticks == pytest.approx([0.0, 0.1, 5.1, 5.2])
