"""A multi-layer perceptron on the robot's and the goal's state, without points: the smallest learned policy.

It sees joint state (14), hand state (9), relative goal (9) and previous action (7), and gives joint residuals.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
import torch
from jaxtyping import Float, Float32, Int
from pydantic import Field
from torch import Tensor, nn

from clutter6d.envs.action import ACTION_SIZE
from clutter6d.envs.observation import Observation
from clutter6d.eval.policy import Episode, PolicyInput
from clutter6d.schema import FileModel

STATE_SIZE = 14 + 9 + 9 + 7
BATCH_ROWS = 32
"""Rows of every forward pass, padded with zeros: a matrix product's last bits depend on the shape of the batch."""


LayerSize = Annotated[int, Field(ge=1, le=4096)]


class StateMlpConfig(FileModel):
    """Architecture of the perceptron.

    Attributes:
        schema_version: Of these fields.
        hidden_sizes: Units of the hidden layers.
        action_scale_rad: Residual at an output of 1; outputs are squashed to plus or minus 1.
    """

    schema_version: Literal[1] = 1
    hidden_sizes: tuple[LayerSize, ...] = Field(default=(256, 128), min_length=1, max_length=8)
    action_scale_rad: float = Field(default=0.1, gt=0, le=0.5)


class StateMlp(nn.Module):
    """State vector to joint residuals [rad].

    Args:
        config: Sizes and scale.
    """

    mean: Tensor
    scale: Tensor

    def __init__(self, config: StateMlpConfig) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(STATE_SIZE))
        self.register_buffer("scale", torch.ones(STATE_SIZE))
        sizes = (STATE_SIZE, *config.hidden_sizes)
        layers: list[nn.Module] = []
        for inputs, outputs in pairwise(sizes):
            layers += [nn.Linear(inputs, outputs), nn.ELU()]
        self.body = nn.Sequential(*layers, nn.Linear(sizes[-1], ACTION_SIZE), nn.Tanh())
        self._action_scale_rad = config.action_scale_rad

    def forward(self, state: Float[Tensor, "row state"]) -> Float[Tensor, "row 7"]:
        """Residuals of each row; the state is first brought to the mean and scale it was trained with."""
        return self._action_scale_rad * self.body((state - self.mean) / self.scale)


class StatePolicy:
    """The perceptron as a policy; keeps no memory, so slots cannot influence one another.

    Args:
        module: The trained perceptron.
        policy_hash: Hash of architecture, configuration and weights.
    """

    name = "state-mlp"
    is_privileged = False
    needs_observation = True

    def __init__(self, module: StateMlp, policy_hash: str) -> None:
        self.policy_hash = policy_hash
        self._module = module.eval()

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:
        """Nothing to remember."""

    def act(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
        """Joint residuals [rad]."""
        assert inputs.observation is not None
        return forward_in_fixed_batches(self._module, state_vector(inputs.observation))


def state_vector(observation: Observation) -> Float32[np.ndarray, "slot state"]:
    """Joint state, hand state, relative goal and previous action, one after the other."""
    parts = ("joint_state", "hand_state", "relative_goal", "previous_action")
    return np.concatenate([observation[part] for part in parts], axis=1)


def forward_in_fixed_batches(
    module: nn.Module, rows: Float32[np.ndarray, "row input"]
) -> Float32[np.ndarray, "row output"]:
    """Run a module on batches of exactly ``BATCH_ROWS`` rows on one thread; a row's result is the same anywhere."""
    count = len(rows)
    padded = np.zeros((-(-count // BATCH_ROWS) * BATCH_ROWS, rows.shape[1]), dtype=np.float32)
    padded[:count] = rows
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with torch.inference_mode():
            batches = torch.from_numpy(padded).split(BATCH_ROWS)
            return np.concatenate([module(batch).numpy() for batch in batches])[:count]
    finally:
        torch.set_num_threads(threads)
