"""Gymnasium's spaces of one environment."""

from typing import Any, Final

import numpy as np
from gymnasium import spaces

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.cameras import camera_spaces
from clutter6d.envs.control_mode import action_bounds
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.observation import OBSERVATION_SHAPES

OBSERVATION_BOUND: Final = 1e4
"""Larger than any number in an observation; Gymnasium asks for finite bounds."""

OBJECT_STATE_SIZE: Final = 15
"""Pose (7), linear velocity in the world frame (3), angular velocity in the object's own (3), mass, friction."""


def make_observation_space(objects: int, config: EnvConfig) -> spaces.Space[Any]:
    """The paper's observations, float32 (Table "Summary of our MDP components"), and what the configuration adds."""
    shapes: dict[str, tuple[int, ...]] = dict(OBSERVATION_SHAPES)
    if config.has_object_states:
        shapes["object_states"] = (objects, OBJECT_STATE_SIZE)
    numbers = {name: _box(shape) for name, shape in shapes.items()}
    return spaces.Dict({**numbers, **camera_spaces(config.cameras)})


def make_action_space(config: ActionConfig) -> spaces.Space[Any]:
    """Joint residuals [rad], or the hand's movement [m, rad], within what is not clipped."""
    bounds = action_bounds(config)
    return spaces.Box(-bounds, bounds, dtype=np.float32)


def _box(shape: tuple[int, ...]) -> spaces.Space[Any]:
    return spaces.Box(-OBSERVATION_BOUND, OBSERVATION_BOUND, shape=shape, dtype=np.float32)
