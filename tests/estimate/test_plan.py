"""From unit costs to hours, cores and bytes."""

import math

import pytest

from clutter6d.errors import InvalidValueError
from clutter6d.estimate.plan import UnitCost, plan_stage

COST = UnitCost(seconds=(1.0, 2.0, 6.0), bytes_each=1000.0, share=0.5, start_s=36.0, serial_s=0.036)


def test_the_mean_is_what_is_summed() -> None:
    assert (COST.mean_s, COST.median_s) == (3.0, 2.0)
    plan = plan_stage(1200, UnitCost(seconds=(1.0, 2.0, 6.0), bytes_each=0.0), workers=1)
    assert plan.core_hours == plan.hours == pytest.approx(1200 * 3.0 / 3600)


def test_ten_thousand_assets_on_ten_workers() -> None:
    plan = plan_stage(10_000, COST, workers=10)
    assert plan.tried == 20_000
    assert plan.hours == pytest.approx((36 + 20_000 * 3 / 10) / 3600)
    assert plan.core_hours == pytest.approx((20_000 * 3 + 10 * 36 + 10_000 * 0.036) / 3600)
    assert plan.bytes == 10_000 * 1000
    assert not plan.is_collector_bound


def test_workers_that_wait_for_the_collector_do_not_help() -> None:
    many, more = (plan_stage(10_000, COST, workers=workers) for workers in (1_000, 2_000))
    assert many.is_collector_bound
    assert many.hours == more.hours == pytest.approx((36 + 10_000 * 0.036) / 3600)


def test_more_workers_than_items_are_as_many_as_the_items() -> None:
    assert plan_stage(2, COST, workers=100) == plan_stage(2, COST, workers=4)


def test_nothing_takes_nothing_but_a_start() -> None:
    assert plan_stage(0, COST, workers=4).bytes == 0


def test_the_error_is_of_the_mean() -> None:
    assert UnitCost(seconds=(2.0, 2.0, 2.0), bytes_each=1.0).error_share == 0
    assert UnitCost(seconds=(1.0, 3.0) * 50, bytes_each=1.0).error_share == pytest.approx(
        1.96 * 1.005 / 10 / 2, rel=1e-3
    )
    assert math.isinf(UnitCost(seconds=(1.0,), bytes_each=1.0).error_share)


def test_nothing_can_be_planned_from_nothing() -> None:
    with pytest.raises(InvalidValueError, match="at least one"):
        UnitCost(seconds=(), bytes_each=1.0)
    with pytest.raises(InvalidValueError, match="nothing can be planned"):
        UnitCost(seconds=(1.0,), bytes_each=1.0, share=0.0)
    with pytest.raises(InvalidValueError, match="workers"):
        plan_stage(1, COST, workers=0)
