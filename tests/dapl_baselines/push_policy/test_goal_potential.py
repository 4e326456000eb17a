import numpy as np
import pytest

from clutter6d.seeding import generator
from dapl_baselines.planners.config import CostConfig, PlannerConfig
from dapl_baselines.planners.costs import goal_cost
from dapl_baselines.push_policy.goal_potential import EDGE_M, EDGE_WEIGHT_PER_M, goal_potential
from tests.dapl_baselines.push_policy.drawn import draw_poses

POSES, GOALS = (draw_poses(50, generator(0, name)) for name in ("poses", "goals"))


def test_it_is_the_planners_price_away_from_the_edge():
    expected = goal_cost(POSES, GOALS, PlannerConfig().rotation_weights_per_rad[0], CostConfig())
    np.testing.assert_array_equal(goal_potential(POSES, GOALS), expected)


@pytest.mark.parametrize(("moved", "beyond"), [((0.1, 0), 0.1), ((0, -0.05), 0.05), ((-0.1, 0.05), 0.15)])
def test_beyond_the_margin_every_metre_costs_as_much_again(moved, beyond):
    pose = np.array([[*(np.sign(moved) * (EDGE_M + np.abs(moved)) * (np.array(moved) != 0)), 0.1, 1, 0, 0, 0]])
    margin = goal_potential(pose, pose)
    np.testing.assert_allclose(margin, EDGE_WEIGHT_PER_M * beyond)


def test_it_is_zero_at_the_goal_and_within_the_dead_bands():
    assert (goal_potential(POSES, POSES) == 0).all()
    config = CostConfig()
    near = POSES + [0.5 * config.position_dead_band_m, 0, 0, 0, 0, 0, 0]
    assert (goal_potential(near, POSES) == 0).all()


def test_single_precision_is_as_good():
    single = goal_potential(POSES.astype(np.float32), GOALS.astype(np.float32))
    np.testing.assert_allclose(single, goal_potential(POSES, GOALS), atol=1e-4)
