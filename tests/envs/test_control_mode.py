import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clutter6d.envs.action import ActionConfig, joint_targets
from clutter6d.envs.control_mode import action_bounds, cartesian_residuals, joint_residuals
from clutter6d.errors import InvalidValueError
from clutter6d.geometry import quat_conjugate, quat_multiply
from clutter6d.seeding import generator
from clutter6d.sim.robot import HOME_QPOS, JOINT_LOWER_RAD, JOINT_UPPER_RAD, hand_jacobian, hand_pose

CARTESIAN = ActionConfig(control="cartesian")
ROWS = 20


def random_arms(seed: int) -> np.ndarray:
    return generator(seed, "arms").uniform(JOINT_LOWER_RAD, JOINT_UPPER_RAD, size=(ROWS, 7))


def random_deltas(seed: int, scale: float) -> np.ndarray:
    return generator(seed, "deltas").normal(scale=scale, size=(ROWS, 6))


def movement(arm_qpos: np.ndarray, residuals: np.ndarray) -> np.ndarray:
    """Translation and rotation vector of the hand, from its poses before and after."""
    before, after = hand_pose(arm_qpos), hand_pose(arm_qpos + residuals)
    turn = quat_multiply(after[:, 3:], quat_conjugate(before[:, 3:]))
    turn *= np.where(turn[:, :1] < 0, -1.0, 1.0)
    return np.concatenate([after[:, :3] - before[:, :3], 2 * turn[:, 1:]], axis=1)


@given(seed=st.integers(0, 10_000))
def test_the_hand_moves_as_asked_to_first_order(seed):
    """What is missing is the damping's share, sigma^2 of the Jacobian against damping^2, and of second order."""
    arms, deltas = random_arms(seed), random_deltas(seed, 1e-4)
    moved = movement(arms, cartesian_residuals(deltas, arms, CARTESIAN))
    size = np.linalg.norm(deltas, axis=1)
    jacobian = hand_jacobian(arms)
    smallest = np.linalg.svd(jacobian, compute_uv=False)[:, -1]
    damped = CARTESIAN.cartesian_damping**2 / (smallest**2 + CARTESIAN.cartesian_damping**2)
    pull = CARTESIAN.posture_pull * size[:, None] * (HOME_QPOS - arms)
    asked = np.linalg.norm(deltas - np.einsum("nij,nj->ni", jacobian, pull), axis=1)
    residuals = cartesian_residuals(deltas, arms, CARTESIAN)
    second_order = 4 * (np.linalg.norm(residuals, axis=1) ** 2) + 1e-9
    assert (np.linalg.norm(moved - deltas, axis=1) <= damped * asked + second_order).all()


def test_over_the_table_a_centimetre_is_a_centimetre():
    arms = HOME_QPOS + generator(0, "near home").uniform(-0.3, 0.3, size=(ROWS, 7))
    deltas = random_deltas(0, 1.0)
    deltas *= 0.01 / np.linalg.norm(deltas, axis=1, keepdims=True)
    moved = movement(arms, cartesian_residuals(deltas, arms, CARTESIAN))
    assert np.linalg.norm(moved - deltas, axis=1).max() < 1e-3


@given(seed=st.integers(0, 10_000))
def test_no_joint_turns_by_more_than_the_action_scale_and_the_hand_keeps_its_direction(seed):
    arms = HOME_QPOS + generator(seed, "near home").uniform(-0.3, 0.3, size=(ROWS, 7))
    deltas = random_deltas(seed, 0.5)
    residuals = cartesian_residuals(deltas, arms, CARTESIAN)
    assert np.abs(residuals).max() <= np.float32(CARTESIAN.action_scale_rad)
    velocity = np.einsum("nij,nj->ni", hand_jacobian(arms), residuals)
    cosine = (velocity * deltas).sum(axis=1) / np.linalg.norm(velocity, axis=1) / np.linalg.norm(deltas, axis=1)
    assert cosine.min() > 0.95


def test_a_hand_that_is_not_asked_to_move_stands_still():
    assert not cartesian_residuals(np.zeros((ROWS, 6)), random_arms(0), CARTESIAN).any()


def test_the_null_space_leads_back_towards_home():
    """Moving to and fro ends with the elbow nearer to home than without the pull."""
    null_space = np.linalg.svd(hand_jacobian(HOME_QPOS[None])[0])[2][-1]
    off_home = HOME_QPOS + 0.5 * null_space
    left = {}
    for pull in (0.0, CARTESIAN.posture_pull):
        config, arms = ActionConfig(control="cartesian", posture_pull=pull), off_home[None]
        for step in range(40):
            delta = np.array([[0.02 if step % 2 else -0.02, 0, 0, 0, 0, 0]])
            arms = arms + cartesian_residuals(delta, arms, config)
        left[pull] = np.linalg.norm(arms - HOME_QPOS)
    assert left[CARTESIAN.posture_pull] < 0.5 * left[0.0]


def test_a_rows_residuals_do_not_depend_on_the_batch():
    arms, deltas = random_arms(0), random_deltas(0, 0.01)
    together = cartesian_residuals(deltas, arms, CARTESIAN)
    alone = [cartesian_residuals(deltas[i : i + 1], arms[i : i + 1], CARTESIAN) for i in range(ROWS)]
    assert np.array_equal(together, np.concatenate(alone))


def test_movements_of_the_hand_pass_the_same_clipping_as_residuals():
    arms, deltas = np.tile(HOME_QPOS, (ROWS, 1)), random_deltas(0, 0.5)
    residuals = joint_residuals(deltas, arms, CARTESIAN)
    targets = joint_targets(residuals, arms, CARTESIAN)
    step = np.einsum("nij,nj->ni", hand_jacobian(arms)[:, :3], targets - arms)
    assert np.linalg.norm(step, axis=1).max() < 1.1 * CARTESIAN.max_hand_step_m


def test_residuals_of_the_joints_pass_unchanged_to_the_bit():
    arms, actions = random_arms(0), generator(0, "actions").uniform(-1, 1, size=(ROWS, 7)).astype(np.float32)
    assert joint_residuals(actions, arms, ActionConfig()).tobytes() == actions.tobytes()


def test_bounds_of_an_action_are_its_clippings():
    np.testing.assert_allclose(action_bounds(ActionConfig(action_scale_rad=0.02)), [0.02] * 7)
    np.testing.assert_allclose(action_bounds(CARTESIAN), [0.05, 0.05, 0.05, 0.1, 0.1, 0.1])


@pytest.mark.parametrize("settings", [{"cartesian_damping": 0.0}, {"posture_pull": -1.0}, {"posture_pull": np.nan}])
def test_impossible_settings_are_refused(settings):
    with pytest.raises(InvalidValueError):
        ActionConfig(**settings)
