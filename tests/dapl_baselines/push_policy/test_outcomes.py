import numpy as np
import pytest

from clutter6d.seeding import generator
from dapl_baselines.push_policy.goal_potential import goal_potential
from dapl_baselines.push_policy.outcomes import Prices, future, gains
from tests.dapl_baselines.push_policy.drawn import draw_poses

ROWS, PRICES = 40, Prices(discount=0.9, step=0.01, success=2.0, drop=-3.0)
RNG = generator(0, "outcomes")
BEFORE, AFTER, GOALS = (draw_poses(ROWS, RNG) for _ in range(3))
STEPS = RNG.integers(1, 40, ROWS)
IS_SUCCESS, IS_DROP = RNG.random((2, ROWS)) < 0.4


def one_by_one(row: int) -> float:
    if IS_DROP[row] and not IS_SUCCESS[row]:
        return PRICES.drop
    start, end = (float(goal_potential(poses[[row]], GOALS[[row]])[0]) for poses in (BEFORE, AFTER))
    return start - end - PRICES.step * STEPS[row] + (PRICES.success if IS_SUCCESS[row] else 0.0)


def test_gains_are_those_of_a_plain_loop():
    found = gains(BEFORE, AFTER, GOALS, steps=STEPS, is_success=IS_SUCCESS, is_drop=IS_DROP, prices=PRICES)
    assert {(bool(a), bool(b)) for a, b in zip(IS_SUCCESS, IS_DROP, strict=True)} == {
        (False, False), (False, True), (True, False), (True, True)
    }  # fmt: skip
    np.testing.assert_allclose(found, [one_by_one(row) for row in range(ROWS)])


def test_what_pushes_bring_in_an_episode_sums_up_to_what_one_long_push_would():
    nothing = np.zeros(ROWS, dtype=bool)
    flags = {"is_success": nothing, "is_drop": nothing, "prices": PRICES}
    first = gains(BEFORE, AFTER, GOALS, steps=STEPS, **flags)
    second = gains(AFTER, BEFORE[::-1].copy(), GOALS, steps=STEPS, **flags)
    whole = gains(BEFORE, BEFORE[::-1].copy(), GOALS, steps=2 * STEPS, **flags)
    np.testing.assert_allclose(first + second, whole, atol=1e-12)


def test_the_future_is_discounted_by_the_steps_until_it_and_ends_with_the_episode():
    value, is_over = np.full(3, 5.0), np.array([False, False, True])
    found = future(value, steps=np.array([1, 3, 1]), is_over=is_over, prices=PRICES)
    np.testing.assert_allclose(found, [4.5, 5 * 0.9**3, 0.0])


@pytest.mark.parametrize("wrong", [{"discount": 0.0}, {"step": -1.0}, {"drop": 1.0}])
def test_prices_that_reward_the_wrong_thing_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Prices(**wrong)
