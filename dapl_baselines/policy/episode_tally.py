"""What is counted of the episodes of a rollout."""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor


@dataclass(frozen=True, kw_only=True, slots=True)
class EpisodeMeans:
    """Means over the episodes that ended since the last look; NaN without any.

    Attributes:
        episodes: How many.
        success_rate: Share that ended at the goal.
        episode_return: Undiscounted sum of the rewards, as the benchmark defines them.
        episode_steps: Control steps.
    """

    episodes: int
    success_rate: float
    episode_return: float
    episode_steps: float


class EpisodeTally:
    """Sums of the episodes that run, and of those that have ended.

    Args:
        envs: Environments.
        device: Where they are.

    Attributes:
        running: Return and steps of the episode that each environment runs.
    """

    def __init__(self, envs: int, device: torch.device) -> None:
        self.running = torch.zeros(envs, 2, dtype=torch.float64, device=device)
        self._ended = torch.zeros(4, dtype=torch.float64, device=device)

    def add(self, rewards: Float[Tensor, "env"], is_over: Bool[Tensor, "env"], is_success: Bool[Tensor, "env"]) -> None:
        """Count one step of every environment."""
        self.running += torch.stack([rewards.double(), torch.ones_like(rewards, dtype=torch.float64)], dim=1)
        ended = torch.stack([is_over.double(), (is_over & is_success).double()], dim=1)
        self._ended += torch.cat([ended, self.running * is_over[:, None]], dim=1).sum(dim=0)
        self.running *= ~is_over[:, None]

    def take(self) -> EpisodeMeans:
        """The means since the last time."""
        episodes, successes, returns, steps = self._ended.tolist()
        self._ended.zero_()
        rate, mean_return, mean_steps = (
            total / episodes if episodes else float("nan") for total in (successes, returns, steps)
        )
        return EpisodeMeans(
            episodes=int(episodes), success_rate=rate, episode_return=mean_return, episode_steps=mean_steps
        )
