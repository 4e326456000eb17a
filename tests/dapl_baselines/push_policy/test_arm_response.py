import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.slots import ClutterSlots
from clutter6d.seeding import generator
from dapl_baselines.push_policy.arm_response import CARRY_S, GAIN, residuals_for
from tests.scene_fixtures import make_box_scene

CONFIG = ActionConfig()
ARMS, HELD, STEPS = 24, 3, 18


@pytest.fixture(scope="module")
def answers() -> dict[str, np.ndarray]:
    """Residuals up to 0.04 rad, held for three steps each, in free space, and how the joints moved."""
    scene, model = make_box_scene()
    env, slots = ClutterSlots([model] * ARMS, threads=1), np.arange(ARMS)
    env.load(slots, [model] * ARMS, [scene.goal_pairs[0]] * ARMS)
    rows = {"residuals": [], "velocities": [], "movements": []}
    for step in range(STEPS):
        if step % HELD == 0:
            residuals = generator(0, "residuals", step).uniform(-0.04, 0.04, (ARMS, 7)).astype(np.float32)
        before = env.batch.arm_qpos.copy()
        rows["velocities"].append(env.batch.arm_qvel.copy())
        env.step(slots, residuals)
        rows["residuals"].append(residuals.astype(np.float64))
        rows["movements"].append(env.batch.arm_qpos - before)
    return {name: np.concatenate(parts) for name, parts in rows.items()}


def test_gains_are_those_of_least_squares_in_the_simulation(answers):
    for joint in range(7):
        causes = np.stack([answers["residuals"][:, joint], answers["velocities"][:, joint]], axis=1)
        (gain, carry), *_ = np.linalg.lstsq(causes, answers["movements"][:, joint], rcond=None)
        assert abs(gain - GAIN[joint]) < 0.05
        assert abs(carry - CARRY_S[joint]) < 0.01


def test_the_arm_moves_as_was_wanted(answers):
    wanted = answers["movements"]
    small = np.abs(answers["residuals"]).max(axis=1) < CONFIG.action_scale_rad
    asked = residuals_for(wanted, answers["velocities"], CONFIG)
    error, plain = (np.abs(each - answers["residuals"])[small].mean() for each in (asked, wanted))
    assert error < 0.5 * plain


vectors = st.lists(st.floats(-3, 3), min_size=7, max_size=7).map(np.array)


@given(steps=vectors, qvel=vectors)
def test_no_residual_exceeds_the_scale_and_the_first_six_keep_their_direction(steps, qvel):
    residuals, scale = residuals_for(steps[None], qvel[None], CONFIG)[0], CONFIG.action_scale_rad
    assert np.abs(residuals).max() <= scale * (1 + 1e-12)
    wanted = (steps - CARRY_S * qvel) / GAIN
    shortening = min(1.0, scale / max(np.abs(wanted[:6]).max(), 1e-9))
    np.testing.assert_allclose(residuals[:6], shortening * wanted[:6], atol=1e-12)
    np.testing.assert_allclose(residuals[6], shortening * np.clip(wanted[6], -scale, scale), atol=1e-12)


def test_a_turn_of_the_hand_does_not_hold_up_the_others():
    steps = np.full((2, 7), 0.01)
    steps[1, 6] = 3.0
    one, other = residuals_for(steps, np.zeros((2, 7)), CONFIG)
    assert np.array_equal(one[:6], other[:6])
    assert other[6] == CONFIG.action_scale_rad


def test_what_the_arm_can_do_is_asked_for_in_full():
    steps = np.full((1, 7), 0.05)
    np.testing.assert_allclose(residuals_for(steps, np.zeros((1, 7)), CONFIG), steps / GAIN)
