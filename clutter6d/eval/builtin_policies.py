"""Policies that need no training: doing nothing, and anything."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Int

from clutter6d.envs.action import ACTION_SIZE, ActionConfig
from clutter6d.eval.policy import Episode, PolicyInput, PolicyOptions, identity_hash
from clutter6d.seeding import generator


@dataclass(frozen=True, kw_only=True, slots=True)
class ZeroPolicy:
    """Residuals of zero: the floor of the mean offset."""

    name: str = "zero"
    policy_hash: str = identity_hash("zero-v1")
    is_privileged: bool = False
    needs_observation: bool = False

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:
        """Nothing to remember."""

    def act(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
        """Zero."""
        return np.zeros((len(inputs.slots), ACTION_SIZE), dtype=np.float32)


@dataclass(frozen=True, kw_only=True, slots=True)
class RandomPolicy:
    """Residuals uniform in plus or minus the action scale; drawn for each seed, scene, pair and step anew."""

    scale_rad: float
    policy_hash: str
    name: str = "random"
    is_privileged: bool = False
    needs_observation: bool = False

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:
        """Nothing to remember."""

    def act(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
        """One draw for each slot, from the generator of its episode and step."""
        rows = [
            generator(episode.seed, "random", episode.scene.scene_id, episode.pair_index, int(step)).uniform(
                -self.scale_rad, self.scale_rad, size=ACTION_SIZE
            )
            for episode, step in zip(inputs.episodes, inputs.steps, strict=True)
        ]
        return np.array(rows, dtype=np.float32).reshape(-1, ACTION_SIZE)


def make_zero(options: PolicyOptions) -> ZeroPolicy:  # noqa: ARG001  every factory takes the options
    """The policy ``zero``."""
    return ZeroPolicy()


def make_random(options: PolicyOptions) -> RandomPolicy:  # noqa: ARG001
    """The policy ``random``."""
    scale = ActionConfig().action_scale_rad
    return RandomPolicy(scale_rad=scale, policy_hash=identity_hash("random-v1", scale))
