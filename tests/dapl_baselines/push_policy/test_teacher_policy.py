from dataclasses import replace

import numpy as np
import pytest

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import TerminationConfig
from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import Episode, PolicyInput
from clutter6d.eval.policy_loading import load_policy
from clutter6d.eval.runner import EpisodeRunner
from clutter6d.sim.batch import SceneBatch
from dapl_baselines.checkpoint import write_checkpoint
from dapl_baselines.push_policy.critic import PushCriticConfig
from dapl_baselines.push_policy.teacher_policy import PushTeacherPolicy
from tests.dapl_baselines.push_policy.test_critic import make_critic
from tests.scene_fixtures import make_box_scene_set

CONFIG = PushCriticConfig(point_sizes=(8, 8), hidden_size=16, segments=6, whole_pushes=6)
STEPS = 24


def make_policy(config: PushCriticConfig = CONFIG) -> PushTeacherPolicy:
    return PushTeacherPolicy(make_critic(config), "0" * 64)


def actions(policy: PushTeacherPolicy, slots: int) -> dict[tuple[str, int], np.ndarray]:
    """What it does in four episodes of two scenes, by scene and pair."""
    scenes = make_box_scene_set(2)
    keys = [(scene.scene_id, pair) for scene in scenes.scenes for pair in range(2)]
    config = EnvConfig(termination=TerminationConfig(max_steps=STEPS))
    runner = EpisodeRunner(scenes, policy, config=config, num_envs=slots, threads=1)
    return {(record.row.scene_id, record.row.pair): record.actions for record in runner.run(keys)}


def test_actions_are_the_same_to_the_bit_whatever_runs_beside():
    alone, beside = actions(make_policy(), 1), actions(make_policy(), 3)
    assert alone.keys() == beside.keys()
    assert all(np.array_equal(alone[key], beside[key]) for key in alone)
    assert all(np.abs(each).max() > 0.01 for each in alone.values())


def test_a_seed_chooses_other_pushes():
    scenes, policy = make_box_scene_set(1), make_policy()
    config = EnvConfig(termination=TerminationConfig(max_steps=40))
    (one,), (other,) = (
        list(EpisodeRunner(scenes, policy, config=config, seed=seed, threads=1).run([("boxes-0", 0)]))
        for seed in (0, 1)
    )
    assert not np.array_equal(one.actions, other.actions)


def episode(scenes: int = 1) -> Episode:
    made = make_box_scene_set(scenes)
    runner = EpisodeRunner(made, make_policy(), threads=1)
    return runner._episode("boxes-0", 0)


def test_it_refuses_scenes_with_another_number_of_objects_in_one_line():
    policy = make_policy(CONFIG.model_copy(update={"obstacles": 7}))
    with pytest.raises(InvalidValueError, match="knows scenes of 8 objects, not of 4") as caught:
        policy.begin(np.array([0]), [episode()])
    assert "\n" not in str(caught.value)


def test_it_needs_the_simulations_state():
    policy, one = make_policy(), episode()
    policy.begin(np.array([0]), [one])
    inputs = PolicyInput(slots=np.array([0]), episodes=(one,), steps=np.array([0]), observation=None, states=None)
    with pytest.raises(InvalidValueError, match="privileged: it needs the simulation's states"):
        policy.act(inputs)
    batch = SceneBatch([one.scene_model], threads=1)
    batch.reset(np.array([0]), one.pair.object_poses[None])
    assert policy.act(replace(inputs, states=batch.states.copy())).shape == (1, 7)


def test_its_checkpoint_is_a_policy_that_does_the_same(tmp_path):
    policy = make_policy()
    write_checkpoint(tmp_path / "x.pt", architecture="push-critic", config=CONFIG, module=policy._critic)
    loaded = load_policy(str(tmp_path / "x.pt"))
    assert loaded.name == "push-teacher"
    found, expected = actions(loaded, 2), actions(policy, 2)
    assert all(np.array_equal(found[key], expected[key]) for key in expected)
