"""A rollout is the recorded episode, simulated again: same end, and everything on the way."""

from dataclasses import replace

import numpy as np
import pytest

from clutter6d.assets.asset import Attributes
from clutter6d.envs.env_config import EnvConfig
from clutter6d.errors import InvalidValueError
from clutter6d.eval.motion import simulate_motion
from clutter6d.recording.rollout import Rollout, simulate_rollout, task_sentence
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.scene_model import SceneModel, compile_stored_scene
from tests.recording.recorded import STEPS, known_episodes, random_episodes


@pytest.fixture(scope="module")
def episodes(tmp_path_factory):
    return random_episodes(tmp_path_factory.mktemp("evaluation"), scenes=1)


def simulate(episodes, number: int = 0, **options) -> tuple[Rollout, SceneModel]:
    record = episodes.records[number]
    scene = next(scene for scene in episodes.scenes.scenes if scene.scene_id == record.row.scene_id)
    model = compile_stored_scene(scene, episodes.scenes.assets_of(scene))
    return simulate_rollout(model, scene, record, EnvConfig(), **options), model


def test_a_rollout_has_one_state_more_than_actions(episodes):
    rollout, _ = simulate(episodes)
    assert len(rollout.actions) == STEPS
    assert rollout.states.object_poses.shape == (STEPS + 1, 4, 7)
    assert rollout.states.hand_state.shape == (STEPS + 1, 9)
    assert rollout.rewards.total.shape == (STEPS,)
    assert rollout.states.clouds is None


def test_a_rollout_begins_at_the_pair_and_ends_as_the_table_says(episodes):
    rollout, _ = simulate(episodes, 1)
    pair = episodes.scenes.scenes[0].goal_pairs[1]
    assert np.array_equal(rollout.states.object_poses[0], pair.object_poses)
    assert np.array_equal(rollout.states.joint_state[0, :7], HOME_QPOS.astype(np.float32))
    assert rollout.errors.position_m[-1] == rollout.row.position_error_m
    assert rollout.errors.rotation_rad[-1] == rollout.row.rotation_error_rad


def test_a_rollout_passes_through_the_states_of_the_motion(episodes):
    rollout, model = simulate(episodes)
    qpos = simulate_motion(model, episodes.scenes.scenes[0], 0, rollout.actions)
    assert np.array_equal(rollout.states.object_poses.reshape(STEPS + 1, -1), qpos[:, 7:])
    assert np.allclose(rollout.states.qpos(), qpos, atol=1e-6)


def test_each_state_knows_the_action_that_led_to_it(episodes):
    rollout, _ = simulate(episodes)
    assert not rollout.states.previous_action[0].any()
    assert np.array_equal(rollout.states.previous_action[1:], rollout.actions)


def test_the_terms_add_up_to_the_reward(episodes):
    rollout, _ = simulate(episodes)
    terms = rollout.rewards
    assert np.array_equal(terms.total, terms.proximity + terms.coarse + terms.fine + terms.success)
    assert (terms.proximity > 0).all()


def test_point_clouds_are_kept_if_asked_for(episodes):
    rollout, _ = simulate(episodes, point_clouds=True)
    assert rollout.states.clouds is not None
    assert rollout.states.clouds.object_points.shape == (STEPS + 1, 512, 7)
    centre = rollout.states.clouds.object_points[:, :, :3].mean(axis=1)
    assert np.allclose(centre, rollout.states.object_poses[:, 0, :3], atol=0.02)


def test_successes_and_drops_are_rollouts_too(tmp_path):
    episodes = known_episodes(tmp_path)
    success, _ = simulate(episodes, 0)
    drop, _ = simulate(episodes, 1)
    assert (success.row.outcome, len(success.actions)) == ("success", 1)
    assert success.rewards.success[-1] > 0
    assert drop.row.outcome == "drop"
    assert drop.states.object_poses[-1, 3, 2] < -0.05


def test_actions_that_lead_elsewhere_are_refused(episodes):
    record = episodes.records[0]
    tampered = replace(episodes, records=(replace(record, actions=-record.actions),))
    with pytest.raises(InvalidValueError, match="boxes-0 pair 0: the recorded actions do not lead"):
        simulate(tampered)


def test_the_task_is_told_in_words():
    origin = dict.fromkeys(("category_from", "colour_from", "material_from", "mass_from", "friction_from"), "rule")
    target = Attributes(category="hand-wheel", colour="dark blue", material="iron", friction=0.5, **origin)
    assert task_sentence(target) == "move the dark blue hand wheel to the goal pose"
