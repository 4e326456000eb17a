"""Recorded episodes against the simulation they were made by."""

import numpy as np

from clutter6d.envs.slots import ClutterSlots
from clutter6d.eval.evaluator import EvaluationConfig
from clutter6d.eval.policy_loading import load_policy
from clutter6d.eval.runner import EpisodeRunner
from dapl_baselines.interactions.recorder import record_episodes, shuffled_keys
from dapl_baselines.interactions.states import pack_states, row_size, unpack_states
from tests.eval.scripted import scenes_with_known_outcomes
from tests.scene_fixtures import make_box_scene_set

CONFIG = EvaluationConfig(max_steps=12).env()


def test_states_are_those_that_the_actions_lead_to():
    scenes, keys = make_box_scene_set(2), [("boxes-0", 0), ("boxes-1", 0), ("boxes-1", 1)]
    runner = EpisodeRunner(scenes, load_policy("random"), config=CONFIG, num_envs=2, threads=1)
    episodes = list(record_episodes(runner, keys))
    assert [episode.key for episode in episodes] == keys
    for episode in episodes:
        env = ClutterSlots([episode.scene_model], CONFIG, threads=1)
        slot = np.zeros(1, dtype=np.int64)
        scene = next(scene for scene in scenes.scenes if scene.scene_id == episode.key[0])
        env.load(slot, [episode.scene_model], [scene.goal_pairs[episode.key[1]]])
        for state, action in zip(episode.states, [*episode.actions, None], strict=True):
            seen = unpack_states(state[None])
            np.testing.assert_array_equal(seen.arm_qpos, env.batch.arm_qpos)
            np.testing.assert_array_equal(seen.arm_qvel, env.batch.arm_qvel)
            np.testing.assert_array_equal(seen.object_poses, env.batch.object_poses)
            np.testing.assert_array_equal(seen.object_velocities, env.batch.object_velocities)
            if action is not None:
                env.step(slot, action[None])


def test_episodes_that_end_early_are_kept_whole_and_the_second_of_success_is_not_part_of_them():
    runner = EpisodeRunner(scenes_with_known_outcomes(), load_policy("zero"), num_envs=1, threads=1)
    kept = {episode.key: episode for episode in record_episodes(runner, [("boxes-0", 1), ("boxes-0", 0)])}
    success, drop = kept["boxes-0", 0], kept["boxes-0", 1]
    assert (success.outcome, len(success.actions), len(success.states)) == ("success", 1, 2)
    assert drop.outcome == "drop"
    assert len(drop.states) == len(drop.actions) + 1 > 2


def test_episodes_come_in_the_order_of_their_keys_whichever_ends_first():
    keys = [("boxes-0", 1), ("boxes-0", 0), ("boxes-1", 1)]
    runner = EpisodeRunner(scenes_with_known_outcomes(), load_policy("zero"), config=CONFIG, num_envs=3, threads=1)
    assert [record.row.key for record in runner.run(keys)] != keys
    assert [episode.key for episode in record_episodes(runner, keys)] == keys


def test_every_episode_is_in_the_shuffled_order_once():
    keys = [(f"scene-{number}", 0) for number in range(50)]
    assert sorted(shuffled_keys(keys, 3)) == sorted(keys)
    assert shuffled_keys(keys, 3) == shuffled_keys(keys, 3) != shuffled_keys(keys, 4)


def test_packing_keeps_every_number():
    rows = np.random.default_rng(0).normal(size=(5, row_size(3)))
    np.testing.assert_array_equal(pack_states(unpack_states(rows)), rows)
