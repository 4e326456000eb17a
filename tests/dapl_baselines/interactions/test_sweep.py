"""The policy that makes contacts on purpose."""

import numpy as np
import pytest

from clutter6d.errors import InvalidValueError
from clutter6d.eval.evaluator import EvaluationConfig
from clutter6d.eval.policy import PolicyInput
from clutter6d.eval.policy_loading import load_policy
from clutter6d.eval.runner import EpisodeRunner
from dapl_baselines.interactions.recorder import record_episodes
from dapl_baselines.interactions.states import unpack_states
from tests.scene_fixtures import make_box_scene_set

KEYS = [("boxes-0", 0), ("boxes-1", 1), ("boxes-2", 0)]


def play(num_envs: int, steps: int = 60):
    config = EvaluationConfig(max_steps=steps).env()
    runner = EpisodeRunner(make_box_scene_set(3), load_policy("sweep"), config=config, num_envs=num_envs, threads=1)
    return {episode.key: episode for episode in record_episodes(runner, KEYS)}


def test_it_moves_objects_where_random_residuals_would_not():
    poses = [unpack_states(episode.states).object_poses for episode in play(3).values()]
    moves = np.concatenate([np.linalg.norm(np.diff(each[..., :3], axis=0), axis=-1) for each in poses])
    assert (moves > 1e-3).any(axis=1).mean() > 0.1


def test_an_episode_does_not_depend_on_the_others():
    together, alone = play(3), play(1)
    for key, episode in together.items():
        np.testing.assert_array_equal(episode.actions, alone[key].actions)


def test_residuals_are_within_the_action_scale():
    assert max(np.abs(episode.actions).max() for episode in play(3, steps=20).values()) <= 0.1 + 1e-7


def test_it_needs_the_states():
    inputs = PolicyInput(slots=np.arange(1), episodes=(), steps=np.zeros(1, int), observation=None, states=None)
    with pytest.raises(InvalidValueError, match="privileged"):
        load_policy("sweep").act(inputs)
