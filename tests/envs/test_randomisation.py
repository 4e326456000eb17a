"""Physics that differ from episode to episode."""

import numpy as np
import pytest

from clutter6d.envs.randomisation import MODEST_RANDOMISATION, RandomisationConfig, draw_physics
from clutter6d.errors import InvalidValueError
from clutter6d.seeding import generator


def draws(config: RandomisationConfig, count: int = 2000) -> list:
    return [draw_physics(config, generator(0, "physics", episode), 4) for episode in range(count)]


def test_nothing_varies_unless_asked():
    config = RandomisationConfig()
    assert not any([config.varies_model, config.varies_table, config.delays_commands])
    draw = draw_physics(config, generator(0), 4)
    assert np.array_equal(draw.mass_scale, np.ones(4))
    assert np.array_equal(draw.friction_scale, np.ones(4))
    assert (draw.table_height_m, draw.latency_steps) == (0.0, 0)


def test_draws_fill_their_ranges():
    drawn = draws(MODEST_RANDOMISATION)
    masses = np.array([draw.mass_scale for draw in drawn])
    assert (masses.min(), masses.max()) == pytest.approx((0.5, 2.0), rel=0.01)
    assert np.log(masses).mean() == pytest.approx(0, abs=0.02), "as often half as double"
    heights = np.array([draw.table_height_m for draw in drawn])
    assert (heights.min(), heights.max()) == pytest.approx((-0.02, 0.02), abs=1e-4)
    frictions = np.array([draw.friction_scale for draw in drawn])
    assert (frictions.min(), frictions.max()) == pytest.approx((0.7, 1.4), rel=0.01)
    assert sorted({draw.latency_steps for draw in drawn}) == list(range(9))


def test_an_episode_draws_the_same_again_and_one_range_moves_no_other_value():
    first, second = (draw_physics(MODEST_RANDOMISATION, generator(3, "x"), 4) for _ in range(2))
    assert np.array_equal(first.mass_scale, second.mass_scale)
    masses_only = RandomisationConfig(mass_scale=MODEST_RANDOMISATION.mass_scale)
    assert np.array_equal(draw_physics(masses_only, generator(3, "x"), 4).mass_scale, first.mass_scale)
    latency_only = RandomisationConfig(latency_s=MODEST_RANDOMISATION.latency_s)
    assert draw_physics(latency_only, generator(3, "x"), 4).latency_steps == first.latency_steps


@pytest.mark.parametrize(
    ("ranges", "message"),
    [
        ({"mass_scale": (2.0, 0.5)}, "mass_scale from 2.0 to 0.5: lower value first"),
        ({"mass_scale": (0.0, 1.0)}, "mass_scale from 0.0"),
        ({"friction_scale": (1.0, float("inf"))}, "friction_scale"),
        ({"table_height_m": (-1.0, 0.0)}, r"both in \[-0.2, 0.2\]"),
        ({"latency_s": (0.0, 0.5)}, r"both in \[0, 0.1\]"),
        ({"latency_s": (0.0, 0.012)}, "not a multiple of the physics step"),
    ],
)
def test_ranges_that_no_physics_has_are_refused(ranges, message):
    with pytest.raises(InvalidValueError, match=message):
        RandomisationConfig(**ranges)
