"""PPO with one trunk: what it shares, and that it learns."""

import pytest
import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from dapl_baselines.policy.config import PolicyNetworkConfig
from dapl_baselines.policy.ppo import STATE_KEY, TOKENS_KEY, assemble
from dapl_baselines.policy.rsl_runner import RslRunner
from dapl_baselines.policy.settings import PpoSettings, TrainingSettings
from tests.dapl_baselines.policy.networks import STATE_ONLY, WITH_POINTS

ENVS = 64
TOKENS = torch.nn.functional.one_hot(torch.arange(12) % 16, 16).half()


class PointReaching(VecEnv):
    """The hand shall go to a point: what is asked for is in the state, or in a token alone; three steps an episode.

    The reward is the negative squared distance between the first two numbers of the action and the point.
    """

    def __init__(self, network: PolicyNetworkConfig, *, is_told_by_tokens: bool = False) -> None:
        self.num_envs, self.num_actions, self.max_episode_length = ENVS, 7, 3
        self.device, self.cfg = torch.device("cpu"), {}
        self.episode_length_buf = torch.zeros(ENVS, dtype=torch.long)
        self._size, self._is_told_by_tokens = network.state_size, is_told_by_tokens
        self._has_tokens = network.encoder is not None
        self._aim()

    def _aim(self) -> None:
        self.points = torch.randint(0, 2, (ENVS, 2)) - 0.5
        self.episode_length_buf.zero_()
        state = torch.zeros(ENVS, self._size)
        seen = {STATE_KEY: state}
        if self._has_tokens:
            seen[TOKENS_KEY] = TOKENS.repeat(ENVS, 1, 1)
        if self._is_told_by_tokens:
            seen[TOKENS_KEY][:, :, :2] = 2 * self.points.half()[:, None]
        else:
            state[:, :2] = self.points
        self._seen = TensorDict(seen, batch_size=[ENVS])

    def get_observations(self) -> TensorDict:
        return self._seen

    def step(self, actions):
        rewards = -(actions[:, :2] - self.points).square().sum(dim=1)
        self.episode_length_buf += 1
        is_over = torch.full((ENVS,), bool(self.episode_length_buf[0] == 3))
        if is_over.any():
            self._aim()
        return self._seen, rewards, is_over, {"time_outs": is_over}


def make_settings(network: PolicyNetworkConfig) -> TrainingSettings:
    ppo = PpoSettings(learning_rate=1e-2, schedule="fixed", num_mini_batches=2, num_learning_epochs=4)
    network = network.model_copy(update={"initial_std": 0.5})
    return TrainingSettings(network=network, ppo=ppo, envs=ENVS, steps_per_env=6)


def make_runner(network: PolicyNetworkConfig, **options) -> RslRunner:
    torch.manual_seed(0)
    return RslRunner(PointReaching(network, **options), make_settings(network), "cpu")


def mean_error(runner: RslRunner) -> float:
    """Mean distance of the most likely action from the point, as squared."""
    with torch.no_grad():
        actions = runner.alg.actor(runner.env.get_observations())
    return float((actions[:, :2] - runner.env.points).square().sum(dim=1).mean())


def test_it_learns_to_reach_a_point_that_the_state_names():
    runner = make_runner(STATE_ONLY)
    assert mean_error(runner) > 0.3
    for _ in range(12):
        runner.learn_once()
    assert mean_error(runner) < 0.05


def test_it_learns_to_reach_a_point_that_only_a_token_names():
    runner = make_runner(WITH_POINTS, is_told_by_tokens=True)
    for _ in range(20):
        runner.learn_once()
    assert mean_error(runner) < 0.1


def test_actor_and_critic_share_one_trunk_and_the_optimiser_sees_each_parameter_once():
    runner = make_runner(WITH_POINTS)
    parameters = [p for group in runner.alg.optimizer.param_groups for p in group["params"]]
    assert len(parameters) == len({id(p) for p in parameters})
    network = assemble(WITH_POINTS, runner.alg, None)
    trained = sum(p.numel() for name, p in network.named_parameters() if not name.startswith("encoder."))
    assert sum(p.numel() for p in parameters) == trained


def test_the_values_gradient_reaches_the_trunk():
    runner = make_runner(WITH_POINTS)
    runner.alg.critic(runner.env.get_observations()).sum().backward()
    assert all(p.grad is not None and p.grad.abs().sum() > 0 for p in runner.alg.actor.trunk.fusion.parameters())


def test_the_trunk_runs_once_for_both_and_never_serves_an_older_observation():
    runner, calls = make_runner(STATE_ONLY), []
    runner.alg.actor.trunk.register_forward_hook(lambda *_: calls.append(1))
    seen = runner.env.get_observations()
    runner.alg.actor(seen, stochastic_output=True)
    value = runner.alg.critic(seen)
    assert len(calls) == 1
    with torch.no_grad():
        runner.alg.actor.trunk.fusion[0].weight.add_(0.1)
    assert not torch.equal(runner.alg.critic(seen), value)
    runner.alg.actor(seen)
    other = seen.clone()
    other[STATE_KEY] += 1
    assert not torch.equal(runner.alg.critic(other), runner.alg.critic(seen))


def test_the_assembled_network_acts_as_the_trained_one_and_is_its_own():
    runner = make_runner(STATE_ONLY)
    runner.learn_once()
    network, seen = assemble(STATE_ONLY, runner.alg, None), runner.env.get_observations()
    with torch.no_grad():
        expected = 0.1 * runner.alg.actor(seen).clamp(-1, 1)
        torch.testing.assert_close(network(seen[STATE_KEY]), expected)
        runner.alg.actor.head[0].weight.add_(1.0)
        torch.testing.assert_close(network(seen[STATE_KEY]), expected)
    torch.testing.assert_close(network.log_std, runner.alg.actor.log_std)


def test_a_runner_prints_and_writes_nothing_and_reports_the_learning_rate(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runner = make_runner(STATE_ONLY)
    report = runner.learn_once()
    assert report.learning_rate == report.last_learning_rate == 1e-2
    assert set(report.losses) == {"value", "surrogate", "entropy"}
    assert capsys.readouterr().out == ""
    assert not list(tmp_path.iterdir())


def test_the_reported_learning_rate_is_the_mean_over_the_mini_batches():
    network = STATE_ONLY
    settings = make_settings(network)
    ppo = settings.ppo.model_copy(update={"schedule": "adaptive", "learning_rate": 1e-3, "desired_kl": 1e-6})
    torch.manual_seed(0)
    runner = RslRunner(PointReaching(network), settings.model_copy(update={"ppo": ppo}), "cpu")
    report = runner.learn_once()
    falling = [1e-3 / 1.5**number for number in range(8)]
    assert report.last_learning_rate == pytest.approx(falling[-1])
    assert report.learning_rate == pytest.approx(sum(falling) / 8)
