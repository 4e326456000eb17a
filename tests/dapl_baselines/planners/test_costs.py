import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from clutter6d.geometry import quat_from_axis_angle
from dapl_baselines.planners.config import CostConfig
from dapl_baselines.planners.costs import disturbance_cost, fall_cost, goal_cost, reach_cost

CONFIG = CostConfig()
GOAL = np.array([0.1, 0.2, 0.05, 1.0, 0.0, 0.0, 0.0])


def _pose(offset_m: float = 0.0, angle_rad: float = 0.0) -> np.ndarray:
    quat = quat_from_axis_angle(np.array([0.0, 0.0, 1.0]), angle_rad)
    return np.concatenate([GOAL[:3] + np.array([offset_m, 0, 0]), quat])[None]


@given(st.floats(0, 0.034), st.floats(0, 0.069))
def test_a_pose_within_both_dead_bands_costs_nothing(offset_m, angle_rad):
    assert goal_cost(_pose(offset_m, angle_rad), GOAL, 0.8, CONFIG)[0] == 0


@given(st.floats(0.05, 1.0), st.floats(0.1, 3.0))
def test_goal_cost_grows_with_either_error(offset_m, angle_rad):
    here = goal_cost(_pose(offset_m, angle_rad), GOAL, 0.8, CONFIG)[0]
    assert goal_cost(_pose(offset_m + 0.01, angle_rad), GOAL, 0.8, CONFIG)[0] > here
    assert goal_cost(_pose(offset_m, angle_rad + 0.01), GOAL, 0.8, CONFIG)[0] > here


def test_the_dead_bands_lie_inside_the_success_thresholds():
    assert CONFIG.position_dead_band_m < 0.05
    assert CONFIG.rotation_dead_band_rad < 0.1


def test_reach_cost_is_free_at_the_surface_and_rises_away_from_it():
    surface = np.array([[0.03, 0.0, 0.0], [-0.03, 0.0, 0.0]])
    tips = GOAL[:3] + np.array([[0.05, 0.0, 0.0], [0.16, 0.0, 0.0]])
    cost = reach_cost(tips, np.repeat(_pose(), 2, axis=0), surface, CONFIG)
    np.testing.assert_allclose(cost, [0.0, 0.5 * 0.10])


def test_disturbance_is_the_mean_displacement_of_the_others_only():
    start = np.tile(GOAL, (3, 1))
    moved = start.copy()[None]
    moved[0, 0, 0] += 1.0
    moved[0, 1, 1] += 0.2
    np.testing.assert_allclose(disturbance_cost(moved, start, CONFIG), [0.5 * 0.1])
    assert disturbance_cost(moved[:, :1], start[:1], CONFIG)[0] == 0


def test_a_target_at_the_edge_and_a_fallen_obstacle_are_penalised():
    poses = np.tile(GOAL, (3, 2, 1))
    poses[1, 0, 0] = 0.45
    poses[2, 1, 2] = -0.1
    np.testing.assert_allclose(fall_cost(poses, CONFIG), [0.0, 5.0, 5.0])
