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
from dapl_baselines.policy.observation import CLOUD_PARTS, object_states
from dapl_baselines.policy.policy import NetworkPolicy
from tests.dapl_baselines.policy.networks import (
    STATE_ONLY,
    WITH_CORN,
    WITH_MEMORY,
    WITH_POINTS,
    make_inputs,
    make_network,
)
from tests.scene_fixtures import make_box_scene_set, write_box_scene_set

FULL_WIDTH = PolicyNetworkConfig(encoder=DaplEncoderConfig(blocks=2))
TEACHER = STATE_ONLY.model_copy(update={"state_parts": ("joint_state", "object_states"), "objects": 4})


@pytest.mark.parametrize("config", [STATE_ONLY, WITH_POINTS, WITH_CORN, FULL_WIDTH])
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


@pytest.mark.parametrize("config", [STATE_ONLY, WITH_POINTS, WITH_CORN, TEACHER])
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


def step_inputs(inputs: tuple[torch.Tensor, ...], slots: list[int], step: int) -> PolicyInput:
    """An observation of which the policy takes two parts of the state, and the points."""
    state, cloud = (part.numpy() for part in inputs)
    points, states = np.split(cloud, [512, 1024], axis=1), np.split(state, [9], axis=1)
    parts = ("hand_state", "relative_goal", *CLOUD_PARTS)
    return PolicyInput(
        slots=np.array(slots),
        episodes=(),
        steps=np.full(len(slots), step),
        observation=dict(zip(parts, (*states, *points), strict=True)),
        states=None,
    )


def test_a_policy_with_a_memory_acts_as_its_network_on_the_last_frames_whatever_other_slots_do():
    config = WITH_MEMORY.model_copy(update={"state_parts": ("hand_state", "relative_goal")})
    network, steps = make_network(config), 5
    policy, alone = (NetworkPolicy(network, "0" * 64) for _ in range(2))
    seen = [make_inputs(config, 3, seed=step) for step in range(steps)]
    policy.begin(np.array([0, 1, 2]), ())
    alone.begin(np.array([7]), ())
    frames = []
    for step, (state, cloud) in enumerate(seen):
        if step == 3:
            policy.begin(np.array([0, 1]), ())
        slots, order = ([0, 1, 2], [1, 0, 2]) if step % 2 else ([2, 0, 1], [2, 0, 1])
        actions = policy.act(step_inputs((state[order], cloud[order]), slots, step))
        own = step_inputs((state[2:], cloud[2:]), [7], step)
        assert np.array_equal(alone.act(own)[0], actions[slots.index(2)])
        with torch.no_grad():
            frames.append(network.see(state[2:], cloud[2:])[0])
            window = torch.stack(([torch.zeros(17)] * 2 + frames)[-3:])
            expected = network.act(window[None])[0]
            np.testing.assert_allclose(actions[slots.index(2)], expected, atol=1e-6)
            np.testing.assert_allclose(alone.latents(own)[0], network.fuse(window[None])[0], atol=1e-5)


def test_checkpoints_from_before_there_was_a_history_are_read_as_they_were(tmp_path):
    network = make_network(WITH_POINTS)
    write_checkpoint(tmp_path / "x.pt", architecture="policy-network", config=WITH_POINTS, module=network)
    content = torch.load(tmp_path / "x.pt", weights_only=True)
    del content["config"]["history"]
    torch.save(content, tmp_path / "old.pt")
    old, inputs = read_checkpoint(tmp_path / "old.pt").module, make_inputs(WITH_POINTS, 3)
    with torch.no_grad():
        assert torch.equal(old.eval()(*inputs), network(*inputs))


@pytest.mark.parametrize(
    ("config", "name"), [(STATE_ONLY, "state-policy"), (WITH_POINTS, "dapl-policy"), (WITH_MEMORY, "dapl-policy")]
)
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
