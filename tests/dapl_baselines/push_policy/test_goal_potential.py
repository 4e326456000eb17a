import numpy as np
import pytest

from clutter6d.geometry import quat_from_axis_angle, quat_from_yaw, quat_multiply
from clutter6d.seeding import generator
from dapl_baselines.planners.config import CostConfig
from dapl_baselines.push_policy.goal_potential import (
    EDGE_M,
    EDGE_WEIGHT_PER_M,
    MEAN_TURN_RAD,
    TILT_WEIGHT_PER_RAD,
    TURN_WEIGHT_PER_RAD,
    goal_potential,
)
from tests.dapl_baselines.push_policy.drawn import draw_poses

POSES, GOALS = (draw_poses(50, generator(0, name)) for name in ("poses", "goals"))
GOAL = np.array([[0.1, 0.2, 0.05, 1.0, 0.0, 0.0, 0.0]])
BANDS = CostConfig()


def turned(tilt: float = 0.0, turn: float = 0.0, away_m: float = 0.0, axis_rad: float = 0.4) -> np.ndarray:
    """At the goal but for a turn about the vertical, then one about a horizontal axis."""
    axis = np.array([np.cos(axis_rad), np.sin(axis_rad), 0.0])
    quat = quat_multiply(quat_from_axis_angle(axis, tilt), quat_from_yaw(np.array(turn)))
    return np.concatenate([GOAL[0, :3] + [0.0, away_m, 0.0], quat])[None]


@pytest.mark.parametrize("away", [0.05, 0.3])
@pytest.mark.parametrize("turn", [-2.0, 0.1, 3.0])
def test_on_the_right_face_distance_and_turn_count_beyond_their_bands(away, turn):
    expected = BANDS.position_weight_per_m * (away - BANDS.position_dead_band_m)
    expected += TURN_WEIGHT_PER_RAD * (abs(turn) - BANDS.rotation_dead_band_rad)
    np.testing.assert_allclose(goal_potential(turned(turn=turn, away_m=away), GOAL), expected)


@pytest.mark.parametrize("turn", [0.0, 1.0, 3.0])
def test_upside_down_the_tilt_counts_and_no_turn_does(turn):
    expected = TILT_WEIGHT_PER_RAD * (np.pi - BANDS.rotation_dead_band_rad) + TURN_WEIGHT_PER_RAD * MEAN_TURN_RAD
    np.testing.assert_allclose(goal_potential(turned(tilt=np.pi, turn=turn), GOAL), expected)


@pytest.mark.parametrize("turn_before", [-3.0, 0.0, 2.0])
@pytest.mark.parametrize("turn_after", [-3.1, 0.0, 1.5, 3.1])
@pytest.mark.parametrize("tilt", [np.pi / 2, 2.0, np.pi])
def test_to_tip_over_onto_the_right_face_always_pays(tilt, turn_before, turn_after):
    before, after = turned(tilt=tilt, turn=turn_before), turned(turn=turn_after)
    assert goal_potential(after, GOAL) < goal_potential(before, GOAL) - 0.35


@pytest.mark.parametrize(("moved", "beyond"), [((0.1, 0), 0.1), ((0, -0.05), 0.05), ((-0.1, 0.05), 0.15)])
def test_beyond_the_margin_every_metre_costs_as_much_again(moved, beyond):
    pose = np.array([[*(np.sign(moved) * (EDGE_M + np.abs(moved)) * (np.array(moved) != 0)), 0.1, 1, 0, 0, 0]])
    margin = goal_potential(pose, pose)
    np.testing.assert_allclose(margin, EDGE_WEIGHT_PER_M * beyond)


def test_it_is_zero_at_the_goal_and_within_the_dead_bands():
    np.testing.assert_allclose(goal_potential(POSES, POSES), 0, atol=1e-12)
    near = 0.9 * BANDS.rotation_dead_band_rad
    assert (goal_potential(turned(turn=near, away_m=0.9 * BANDS.position_dead_band_m), GOAL) == 0).all()


def test_single_precision_is_as_good():
    single = goal_potential(POSES.astype(np.float32), GOALS.astype(np.float32))
    np.testing.assert_allclose(single, goal_potential(POSES, GOALS), atol=1e-4)
