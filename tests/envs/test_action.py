import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clutter6d.envs.action import ActionConfig, clip_hand_step, joint_targets
from clutter6d.errors import InvalidValueError
from clutter6d.seeding import generator
from clutter6d.sim.robot import HOME_QPOS, JOINT_LOWER_RAD, JOINT_UPPER_RAD, hand_jacobian

CONFIG = ActionConfig()


def random_arms(rows: int, seed: int = 0) -> np.ndarray:
    reach = 0.5 * (JOINT_UPPER_RAD - HOME_QPOS)
    return HOME_QPOS + generator(seed, "arms").uniform(-0.5, 0.5, size=(rows, 7)) * reach


def random_actions(rows: int, scale: float, seed: int = 0) -> np.ndarray:
    return generator(seed, "actions").uniform(-scale, scale, size=(rows, 7)).astype(np.float32)


def test_small_residuals_reach_the_arm_unchanged_to_the_bit():
    arms, actions = random_arms(50), random_actions(50, 0.01)
    assert np.array_equal(joint_targets(actions, arms, CONFIG), arms + actions.astype(np.float64))


def test_residuals_are_clipped_to_the_action_scale():
    arms = np.tile(HOME_QPOS, (1, 1))
    wrist_only = np.array([[0, 0, 0, 0, 0, 0, 3.0]], dtype=np.float32)
    assert joint_targets(wrist_only, arms, CONFIG)[0, 6] == arms[0, 6] + CONFIG.action_scale_rad


@given(seed=st.integers(0, 10_000))
def test_the_hand_is_commanded_no_further_than_its_bound(seed):
    arms, actions = random_arms(20, seed), random_actions(20, 0.1, seed)
    jacobian = hand_jacobian(arms)[:, :3]
    clipped = clip_hand_step(actions.astype(np.float64), jacobian, CONFIG)
    before = np.linalg.norm(np.einsum("nij,nj->ni", jacobian, actions), axis=1)
    after = np.linalg.norm(np.einsum("nij,nj->ni", jacobian, clipped), axis=1)
    excess = np.maximum(before - CONFIG.max_hand_step_m, 0)
    smallest = np.linalg.svd(jacobian, compute_uv=False)[:, -1]
    left = CONFIG.damping**2 / (smallest**2 + CONFIG.damping**2)
    assert (after <= CONFIG.max_hand_step_m + left * excess + 1e-7).all()


def test_the_excess_is_removed_by_the_papers_damped_pseudo_inverse():
    arms, residuals = random_arms(30), random_actions(30, 0.1).astype(np.float64)
    jacobian = hand_jacobian(arms)[:, :3]
    clipped = clip_hand_step(residuals, jacobian, CONFIG)
    for row in range(30):
        J = jacobian[row]
        step = J @ residuals[row]
        length = np.linalg.norm(step)
        if length <= CONFIG.max_hand_step_m:
            assert np.array_equal(clipped[row], residuals[row])
            continue
        step_excess = step * (1 - CONFIG.max_hand_step_m / length)
        excess = J.T @ np.linalg.inv(J @ J.T + CONFIG.damping**2 * np.eye(3)) @ step_excess
        np.testing.assert_allclose(clipped[row], residuals[row] - excess, atol=1e-7)


def test_targets_stay_within_the_joint_limits():
    arms = np.stack([JOINT_LOWER_RAD, JOINT_UPPER_RAD])
    actions = np.array([[-0.1] * 7, [0.1] * 7], dtype=np.float32)
    targets = joint_targets(actions, arms, CONFIG)
    assert (targets >= JOINT_LOWER_RAD).all()
    assert (targets <= JOINT_UPPER_RAD).all()


def test_a_rows_targets_do_not_depend_on_the_batch():
    arms, actions = random_arms(67), random_actions(67, 0.1)
    together = joint_targets(actions, arms, CONFIG)
    alone = np.concatenate([joint_targets(actions[i : i + 1], arms[i : i + 1], CONFIG) for i in range(67)])
    assert np.array_equal(together, alone)
    order = generator(0, "order").permutation(67)
    assert np.array_equal(joint_targets(actions[order], arms[order], CONFIG), together[order])


@pytest.mark.parametrize("settings", [{"action_scale_rad": 0.0}, {"max_hand_step_m": -1.0}, {"damping": 0.0}])
def test_impossible_settings_are_refused(settings):
    with pytest.raises(InvalidValueError):
        ActionConfig(**settings)
