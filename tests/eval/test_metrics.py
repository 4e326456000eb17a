import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clutter6d.assets.asset import SymmetryGroup
from clutter6d.eval.metrics import (
    bootstrap_interval,
    chamfer_distance_m,
    mean_offset_cm,
    symmetric_rotation_error_rad,
    wilson_interval,
)
from clutter6d.geometry import quat_from_axis_angle, quat_multiply, quat_normalize, rotation_error_rad
from clutter6d.seeding import generator
from tests.scene_fixtures import make_box_scene

IDENTITY = np.array([[1.0, 0, 0, 0]])
HALF_TURN_X = np.array([0.0, 1.0, 0, 0])
BOX = SymmetryGroup(discrete_quats_wxyz=np.array([[1.0, 0, 0, 0], HALF_TURN_X]), continuous_axis=None)
CAN = SymmetryGroup(discrete_quats_wxyz=np.array([[1.0, 0, 0, 0], HALF_TURN_X]), continuous_axis=(0.0, 0.0, 1.0))
NONE = SymmetryGroup(discrete_quats_wxyz=IDENTITY, continuous_axis=None)


def random_quat(seed: int) -> np.ndarray:
    return quat_normalize(generator(seed, "quat").normal(size=4))


@pytest.mark.parametrize(
    ("successes", "trials", "interval"),
    [(0, 10, (0.0, 0.2775)), (10, 10, (0.7225, 1.0)), (9, 12, (0.4677, 0.9111)), (50, 100, (0.4038, 0.5962))],
)
def test_wilson_interval_has_the_published_values(successes, trials, interval):
    np.testing.assert_allclose(wilson_interval(successes, trials), interval, atol=1e-4)


def test_bootstrap_interval_holds_the_mean_and_repeats():
    values = generator(0, "values").normal(5, 1, size=200)
    low, high = bootstrap_interval(values, 0)
    assert low < values.mean() < high
    np.testing.assert_allclose(high - low, 2 * 1.96 * values.std() / np.sqrt(200), rtol=0.15)
    assert bootstrap_interval(values, 0) == (low, high)
    assert bootstrap_interval(values, 1) != (low, high)


def test_chamfer_distance_is_the_mean_of_the_two_directed_means():
    a, b = np.array([[0.0, 0, 0]]), np.array([[1.0, 0, 0], [3.0, 0, 0]])
    assert chamfer_distance_m(a, b) == (1.0 + 2.0) / 2
    assert chamfer_distance_m(b, a) == chamfer_distance_m(a, b)


def test_objects_that_did_not_move_have_no_offset():
    scene, model = make_box_scene()
    poses = scene.goal_pairs[0].object_poses
    assert mean_offset_cm(model.assets, poses, poses.copy()) == 0.0


def test_the_targets_own_movement_is_no_offset():
    scene, model = make_box_scene()
    poses = scene.goal_pairs[0].object_poses
    moved = poses.copy()
    moved[0, :3] += 0.2
    assert mean_offset_cm(model.assets, poses, moved) == 0.0


def test_mean_offset_is_averaged_over_the_obstacles_in_centimetres():
    scene, model = make_box_scene()
    poses = scene.goal_pairs[0].object_poses
    moved = poses.copy()
    moved[1, 0] += 5.0
    offset = mean_offset_cm(model.assets, poses, moved)
    assert 480 / 3 < offset < 500 / 3


@given(seed=st.integers(0, 10_000))
def test_without_symmetry_the_error_is_the_plain_angle(seed):
    a, b = random_quat(seed), random_quat(seed + 1)
    np.testing.assert_allclose(symmetric_rotation_error_rad(a, b, NONE), rotation_error_rad(a, b), atol=1e-7)


@given(seed=st.integers(0, 10_000))
def test_a_discrete_symmetry_in_the_objects_frame_costs_nothing(seed):
    quat = random_quat(seed)
    assert symmetric_rotation_error_rad(quat_multiply(quat, HALF_TURN_X), quat, BOX) < 1e-7


@given(seed=st.integers(0, 10_000), angle=st.floats(-np.pi, np.pi))
def test_a_turn_about_a_continuous_axis_costs_nothing(seed, angle):
    quat = random_quat(seed)
    turned = quat_multiply(quat, quat_from_axis_angle(np.array([0.0, 0, 1.0]), angle))
    assert symmetric_rotation_error_rad(turned, quat, CAN) < 1e-7
    assert symmetric_rotation_error_rad(quat_multiply(turned, HALF_TURN_X), quat, CAN) < 1e-7


@given(seed=st.integers(0, 10_000))
def test_the_closed_form_is_the_minimum_over_turns_about_the_axis(seed):
    quat, goal = random_quat(seed), random_quat(seed + 1)
    angles = np.linspace(0, 2 * np.pi, 2001)
    turns = quat_from_axis_angle(np.tile([0.0, 0, 1.0], (2001, 1)), angles)
    errors = [
        rotation_error_rad(quat_multiply(quat_multiply(quat, symmetry)[None], turns), goal[None]).min()
        for symmetry in CAN.discrete_quats_wxyz
    ]
    np.testing.assert_allclose(symmetric_rotation_error_rad(quat, goal, CAN), min(errors), atol=2e-3)


@given(seed=st.integers(0, 10_000))
def test_symmetry_never_makes_the_error_larger(seed):
    quat, goal = random_quat(seed), random_quat(seed + 1)
    plain = rotation_error_rad(quat, goal)
    assert symmetric_rotation_error_rad(quat, goal, CAN) <= plain + 1e-9
    assert symmetric_rotation_error_rad(quat, goal, BOX) <= plain + 1e-9
