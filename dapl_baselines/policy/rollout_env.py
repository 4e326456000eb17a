"""The environments as rsl_rl sees them, with points already encoded."""

from collections.abc import Mapping
from typing import Any, cast

import numpy as np
import torch
from jaxtyping import Bool, Float32
from rsl_rl.env import VecEnv
from tensordict import TensorDict
from torch import Tensor

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.action import ACTION_SIZE
from clutter6d.envs.devices import make_vector_env
from clutter6d.envs.vector_env import ClutterVectorEnv, Snapshot
from dapl_baselines.policy.config import PolicyNetworkConfig
from dapl_baselines.policy.encoder_source import EncoderSource
from dapl_baselines.policy.episode_tally import EpisodeTally
from dapl_baselines.policy.frozen_encoder import FrozenEncoder
from dapl_baselines.policy.observation import cloud, hand_state, state_vector
from dapl_baselines.policy.ppo import STATE_KEY, TOKENS_KEY
from dapl_baselines.policy.settings import TrainingSettings


class RolloutEnv(VecEnv):
    """A vector environment that resets itself at once (``SameStep``), on CPU or GPU.

    An action of plus or minus 1 is a residual of the whole action scale, as it is at that step; more is clipped. Of an
    episode that runs out of time, rsl_rl hears by ``time_outs`` and counts on with the value of the state before.

    Args:
        envs: :class:`~clutter6d.envs.vector_env.ClutterVectorEnv` or its sister on the GPU.
        network: What the policy sees.
        encoder: What makes tokens of points; ``None``: it sees none.
        reward_scale: Factor of the reward, before it is learned from.

    Attributes:
        envs: The environments.
        tally: What became of the episodes.
    """

    def __init__(
        self, envs: Any, network: PolicyNetworkConfig, encoder: FrozenEncoder | None, *, reward_scale: float
    ) -> None:
        self.envs, self._network, self._encoder, self._reward_scale = envs, network, encoder, reward_scale
        self.num_envs, self.num_actions = int(envs.num_envs), ACTION_SIZE
        self.device = getattr(envs, "device", torch.device("cpu"))
        self.max_episode_length = envs.config.termination.max_steps
        self.episode_length_buf = torch.zeros(self.num_envs, dtype=torch.long, device=self.device)
        self.cfg: dict[str, object] = {}
        self.tally = EpisodeTally(self.num_envs, self.device)
        self._seen = TensorDict({}, batch_size=[self.num_envs])

    def reset(self, seed: int) -> None:
        """Begin episodes in all environments."""
        self._seen = self._encode(self.envs.reset(seed=seed)[0])

    @property
    def can_be_restored(self) -> bool:
        """Whether the simulation can be stopped and taken up again, as it can on the CPU."""
        return isinstance(self.envs, ClutterVectorEnv)

    def snapshot(self) -> Snapshot:
        """Where the environments are."""
        return cast(ClutterVectorEnv, self.envs).snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from where environments were."""
        self._seen = self._encode(cast(ClutterVectorEnv, self.envs).restore(snapshot))

    def get_observations(self) -> TensorDict:
        """The observation that is to be acted on."""
        return self._seen

    def step(self, actions: Float32[Tensor, "env 7"]) -> tuple[TensorDict, Tensor, Tensor, dict[str, Any]]:
        """Act; returns observations, rewards, which episodes are over, and which of these ran out of time."""
        residuals = actions.clamp(-1, 1) * self._action_scale_rad()
        given = residuals if self.device.type == "cuda" else residuals.numpy()
        observation, rewards, terminated, truncated, info = self.envs.step(given)
        reward, ended, timed_out = (self._tensor(value) for value in (rewards, terminated, truncated))
        self.tally.add(reward, ended | timed_out, self._successes(info))
        self._seen = self._encode(observation)
        return self._seen, self._reward_scale * reward.float(), ended | timed_out, {"time_outs": timed_out}

    def _action_scale_rad(self) -> float:
        """The action scale that the environments' next step will have."""
        curriculum = self.envs.config.action.curriculum
        return self.envs.action_scale_rad if curriculum is None else curriculum.at(self.envs.training_step)

    def _successes(self, info: Mapping[str, Any]) -> Bool[Tensor, "env"]:
        """Which of the episodes that just ended did so at the goal."""
        if "final_info" not in info:
            return torch.zeros(self.num_envs, dtype=torch.bool, device=self.device)
        return self._tensor(info["final_info"]["is_success"])

    def _encode(self, observation: Mapping[str, Any]) -> TensorDict:
        seen = {STATE_KEY: state_vector(observation, self._network.state_parts)}
        if self._encoder is not None:
            seen[TOKENS_KEY] = self._encoder(cloud(observation), hand_state(observation))
        return TensorDict(seen, batch_size=[self.num_envs], device=self.device)

    def _tensor(self, value: np.ndarray | Tensor) -> Tensor:
        return torch.as_tensor(value, device=self.device)


def make_rollout_env(
    scenes: SceneCollection,
    settings: TrainingSettings,
    source: EncoderSource | None,
    *,
    device: str = "cpu",
    rank: int = 0,
    threads: int = 0,
) -> RolloutEnv:
    """The environments of a training at their start.

    Args:
        scenes: What is trained on.
        settings: Of the training.
        source: The encoder, which is frozen; one with random weights is first brought to the scale of what it sees.
        device: Where they run.
        rank: Which of several processes this is: each has episodes of its own.
        threads: Threads of the simulation; 0 for all cores. There is no such choice on a GPU.
    """
    options = {"threads": threads} if device == "cpu" else {}
    config, envs_each = settings.env(), settings.envs
    envs = make_vector_env(
        device=device, num_envs=envs_each, split=scenes, config=config, autoreset_mode="SameStep", **options
    )
    encoder = None
    if source is not None:
        module = source.module.to(device)
        if not source.history:
            module.train().update_statistics(cloud(envs.reset(seed=settings.seed)[0]))
        encoder = FrozenEncoder(module, device, getattr(torch, settings.encoder_precision))
    env = RolloutEnv(envs, settings.network, encoder, reward_scale=settings.reward_scale)
    env.reset(seed=settings.seed + rank * envs_each)
    return env
