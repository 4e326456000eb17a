import numpy as np
import pytest
import torch

from clutter6d.cli import run
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.vector_env import ClutterVectorEnv
from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import Episode, PolicyInput
from clutter6d.eval.policy_loading import load_policy
from clutter6d.seeding import generator
from dapl_baselines.checkpoint import read_checkpoint, write_checkpoint
from dapl_baselines.encoders.dapl import DaplEncoderConfig
from dapl_baselines.fixed_batches import BATCH_ROWS, forward_in_fixed_batches
from dapl_baselines.policy.config import PolicyNetworkConfig
from dapl_baselines.policy.observation import object_states
from dapl_baselines.policy.policy import NetworkPolicy
from tests.dapl_baselines.policy.networks import STATE_ONLY, WITH_POINTS, make_inputs, make_network
from tests.scene_fixtures import make_box_scene_set, write_box_scene_set

FULL_WIDTH = PolicyNetworkConfig(encoder=DaplEncoderConfig(blocks=2))
TEACHER = STATE_ONLY.model_copy(update={"state_parts": ("joint_state", "object_states"), "objects": 4})


@pytest.mark.parametrize("config", [STATE_ONLY, WITH_POINTS, FULL_WIDTH])
@pytest.mark.parametrize("rows", [1, BATCH_ROWS, BATCH_ROWS + 1])
def test_a_rows_action_is_the_same_to_the_bit_wherever_it_stands(config, rows):
    network, inputs = make_network(config), make_inputs(config, 50)
    whole = forward_in_fixed_batches(network, *inputs)
    first = forward_in_fixed_batches(network, *(part[:rows] for part in inputs))
    assert np.array_equal(first, whole[:rows])
    order = generator(rows, "order").permutation(50)
    assert np.array_equal(forward_in_fixed_batches(network, *(part[order] for part in inputs)), whole[order])


def inputs_of(env: ClutterVectorEnv, observation: dict, policy: NetworkPolicy) -> PolicyInput:
    tasks = env.streams.tasks
    return PolicyInput(
        slots=np.arange(env.num_envs),
        episodes=tuple(
            Episode(scene=task.scene, pair_index=task.pair_index, scene_model=task.model, seed=0) for task in tasks
        ),
        steps=np.zeros(env.num_envs, dtype=np.int64),
        observation=observation,
        states=env._episodes.core.batch.states.copy() if policy.is_privileged else None,
    )


@pytest.mark.parametrize("config", [STATE_ONLY, WITH_POINTS, TEACHER])
def test_a_policy_acts_on_what_the_environment_shows(config):
    env = ClutterVectorEnv(3, split=make_box_scene_set(2), config=EnvConfig(has_object_states=True))
    observation, _ = env.reset(seed=0)
    policy = NetworkPolicy(make_network(config), "0" * 64)
    actions = policy.act(inputs_of(env, observation, policy))
    assert (actions.dtype, actions.shape) == (np.float32, (3, 7))
    assert len(np.unique(actions, axis=0)) > 1


def test_a_teacher_refuses_scenes_with_another_number_of_objects():
    env = ClutterVectorEnv(2, split=make_box_scene_set(2))
    observation, _ = env.reset(seed=0)
    policy = NetworkPolicy(make_network(TEACHER.model_copy(update={"objects": 8})), "0" * 64)
    with pytest.raises(InvalidValueError, match="knows scenes of 8 objects, these have 4"):
        policy.act(inputs_of(env, observation, policy))


def test_object_states_from_the_simulations_state_are_those_of_the_observation():
    env = ClutterVectorEnv(2, split=make_box_scene_set(2), config=EnvConfig(has_object_states=True))
    env.reset(seed=0)
    observation = env.step(np.full((2, 7), 0.05, dtype=np.float32))[0]
    states, scenes = env._episodes.core.batch.states, [task.model for task in env.streams.tasks]
    assert np.array_equal(object_states(states, scenes), observation["object_states"])


@pytest.mark.parametrize(("config", "name"), [(STATE_ONLY, "state-policy"), (WITH_POINTS, "dapl-policy")])
def test_evaluate_and_replay_take_its_checkpoint(tmp_path, config, name):
    write_checkpoint(tmp_path / "x.pt", architecture="policy-network", config=config, module=make_network(config))
    assert load_policy(str(tmp_path / "x.pt")).name == name
    write_box_scene_set(tmp_path / "scenes", 1)
    where = ["--scenes", str(tmp_path / "scenes"), "--out", str(tmp_path / "out"), "--max-steps", "3"]
    assert run(["evaluate", "--policy", str(tmp_path / "x.pt"), *where, "--threads", "1"]) == 0
    assert run(["replay", str(tmp_path / "out"), "--threads", "1"]) == 0


def test_the_whole_policy_takes_less_than_10_megabytes_in_half_precision(tmp_path):
    config = PolicyNetworkConfig(encoder=DaplEncoderConfig())
    network = make_network(config)
    write_checkpoint(
        tmp_path / "x.pt", architecture="policy-network", config=config, module=network, precision="float16"
    )
    assert (tmp_path / "x.pt").stat().st_size < 10e6
    read = dict(read_checkpoint(tmp_path / "x.pt").module.named_parameters())
    for parameter, weights in network.named_parameters():
        assert torch.equal(read[parameter], weights.half().float())
