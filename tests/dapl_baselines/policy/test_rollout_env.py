import numpy as np
import pytest
import torch

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.action_scale import ActionScaleCurriculum
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import TerminationConfig
from clutter6d.envs.vector_env import ClutterVectorEnv
from dapl_baselines.encoders.dapl import DaplEncoder
from dapl_baselines.encoders.registry import make_encoder
from dapl_baselines.policy.config import PolicyNetworkConfig
from dapl_baselines.policy.frozen_encoder import FrozenEncoder
from dapl_baselines.policy.observation import cloud, hand_state, state_vector
from dapl_baselines.policy.ppo import STATE_KEY, TOKENS_KEY
from dapl_baselines.policy.rollout_env import RolloutEnv
from tests.dapl_baselines.policy.networks import SMALL_CORN, SMALL_ENCODER, STATE_ONLY, WITH_POINTS
from tests.scene_fixtures import make_box_scene_set

SCENES = make_box_scene_set(3)


def make_envs(max_steps: int = 300, action: ActionConfig | None = None, size: int = 3) -> ClutterVectorEnv:
    config = EnvConfig(termination=TerminationConfig(max_steps=max_steps), action=action or ActionConfig())
    return ClutterVectorEnv(size, split=SCENES, config=config, autoreset_mode="SameStep", threads=1)


def make_rollout_env(
    network: PolicyNetworkConfig = STATE_ONLY, *, encoder: FrozenEncoder | None = None, **options
) -> RolloutEnv:
    env = RolloutEnv(make_envs(**options), network, encoder, reward_scale=0.1)
    env.reset(seed=3)
    return env


def push(size: int = 3) -> torch.Tensor:
    return torch.linspace(-0.5, 0.5, 7).repeat(size, 1)


def test_the_state_is_the_papers_parts_of_the_observation_in_order():
    observation, _ = make_envs().reset(seed=3)
    state = state_vector(observation, STATE_ONLY.state_parts)
    parts = ("hand_state", "joint_state", "relative_goal", "physics_parameters", "previous_action")
    assert np.array_equal(state.numpy(), np.concatenate([observation[part] for part in parts], axis=1))
    torch.testing.assert_close(make_rollout_env().get_observations()[STATE_KEY], state)


def test_actions_are_shares_of_the_action_scale_and_rewards_are_scaled():
    env, plain = make_rollout_env(), make_envs()
    plain.reset(seed=3)
    for actions in (push(), 10 * push()):
        seen, rewards, is_over, extras = env.step(actions)
        observation, expected, _, _, _ = plain.step(0.1 * actions.clamp(-1, 1).numpy())
        torch.testing.assert_close(seen[STATE_KEY], state_vector(observation, STATE_ONLY.state_parts))
        torch.testing.assert_close(rewards, torch.as_tensor(0.1 * expected, dtype=torch.float32))
        assert not is_over.any()
        assert not extras["time_outs"].any()


def test_the_scale_is_that_of_the_curriculum_at_the_very_step():
    action = ActionConfig(curriculum=ActionScaleCurriculum(steps=4))
    env = make_rollout_env(action=action)
    for step in range(6):
        seen = env.step(torch.ones(3, 7))[0]
        asked = seen[STATE_KEY][:, -7:]
        torch.testing.assert_close(asked, torch.full_like(asked, action.curriculum.at(step)))


def test_an_episode_that_runs_out_of_time_is_over_and_says_so():
    env = make_rollout_env(max_steps=2)
    assert not env.step(push())[2].any()
    _, rewards, is_over, extras = env.step(push())
    assert is_over.all()
    assert extras["time_outs"].all()
    means = env.tally.take()
    assert (means.episodes, means.success_rate, means.episode_steps) == (3, 0.0, 2.0)
    assert means.episode_return > rewards.mean() / 0.1
    assert env.tally.take().episodes == 0


def test_a_success_is_counted_and_is_no_time_out():
    env = make_rollout_env(size=2)
    core = env.envs._episodes.core
    core.batch.object_poses[1, 0] = core.goals[1]
    _, rewards, is_over, extras = env.step(torch.zeros(2, 7))
    assert is_over.tolist() == [False, True]
    assert not extras["time_outs"].any()
    assert rewards[1] > 100
    assert env.tally.take().success_rate == 1.0


@pytest.mark.parametrize("compute", [torch.float32, torch.bfloat16])
def test_points_are_encoded_once_a_step_and_only_tokens_are_kept(compute):
    module, calls = DaplEncoder(SMALL_ENCODER), []
    module.register_forward_hook(lambda *_: calls.append(1))
    env = make_rollout_env(WITH_POINTS, encoder=FrozenEncoder(module, "cpu", compute))
    assert len(calls) == 1
    seen = env.step(push())[0]
    assert len(calls) == 2
    assert env.get_observations() is seen
    assert set(seen.keys()) == {STATE_KEY, TOKENS_KEY}
    assert (seen[TOKENS_KEY].shape, seen[TOKENS_KEY].dtype) == ((3, 40, 16), torch.float16)
    with torch.no_grad():
        observation = env.envs._observe()
        expected = module(cloud(observation), hand_state(observation))
    torch.testing.assert_close(seen[TOKENS_KEY].float(), expected, atol=0.05, rtol=0.05)
    assert not any(parameter.requires_grad for parameter in module.parameters())


@pytest.mark.parametrize("config", [SMALL_ENCODER, SMALL_CORN])
def test_clouds_are_encoded_in_parts_that_bound_the_memory(config):
    torch.manual_seed(0)
    module, seen = make_encoder(config).eval(), (0.1 * torch.randn(5, 1280, 7), torch.randn(5, 9))
    parts, whole = (FrozenEncoder(module, "cpu", torch.float32, batch=size)(*seen) for size in (2, 5))
    torch.testing.assert_close(parts, whole)


def test_a_restored_environment_shows_and_does_the_same():
    env, other = make_rollout_env(max_steps=3), make_rollout_env(max_steps=3)
    for _ in range(4):
        env.step(push())
    other.restore(env.snapshot())
    assert torch.equal(other.get_observations()[STATE_KEY], env.get_observations()[STATE_KEY])
    for _ in range(3):
        for ours, theirs in zip(env.step(push())[:3], other.step(push())[:3], strict=True):
            assert (ours == theirs).all()
