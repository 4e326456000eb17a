"""Gymnasium's spaces of one environment."""

from typing import Any, Final

import numpy as np
from gymnasium import spaces

from clutter6d.envs.action import ACTION_SIZE, ActionConfig
from clutter6d.envs.observation import OBSERVATION_SHAPES

OBSERVATION_BOUND: Final = 1e4
"""Larger than any entry of an observation; Gymnasium asks for finite bounds."""


def make_observation_space() -> spaces.Space[Any]:
    """The paper's observations, float32 (Table "Summary of our MDP components")."""
    return spaces.Dict({name: _unbounded(shape) for name, shape in OBSERVATION_SHAPES.items()})


def make_action_space(config: ActionConfig) -> spaces.Space[Any]:
    """Joint residuals [rad] within the action scale."""
    scale = config.action_scale_rad
    return spaces.Box(-scale, scale, shape=(ACTION_SIZE,), dtype=np.float32)


def _unbounded(shape: tuple[int, ...]) -> spaces.Space[Any]:
    return spaces.Box(-OBSERVATION_BOUND, OBSERVATION_BOUND, shape=shape, dtype=np.float32)
