"""How the arm answers a residual, and the residual that makes it move as wanted."""

from typing import Final

import numpy as np
from jaxtyping import Float64

from clutter6d.envs.action import ActionConfig

GAIN: Final = np.array([0.615, 0.544, 0.673, 0.712, 0.848, 0.807, 0.879])
CARRY_S: Final = np.array([0.010, 0.018, 0.014, 0.015, 0.006, 0.009, 0.003])
"""In one control step joint j moves by ``GAIN[j]`` times its residual plus ``CARRY_S[j]`` times its velocity.

Least squares on random residuals up to 0.04 rad, held for three steps each, in free space (1,920 steps). A residual
that ignores this lets the heavy joints lag behind the light ones: a hand sent straight ahead rises by 0.4 of its way.
"""

_LAST_JOINT: Final = 6


def residuals_for(
    steps_rad: Float64[np.ndarray, "n 7"], qvel: Float64[np.ndarray, "n 7"], config: ActionConfig
) -> Float64[np.ndarray, "n 7"]:
    """Residuals after which the joints have moved by given steps, or as far in the same direction as allowed.

    The last joint only turns the hand about its own axis and is cut alone, first; then all are shortened together, so
    that the tips' path keeps its direction.

    Args:
        steps_rad: Wanted movement of each joint in one control step.
        qvel: Joint velocities [rad/s].
        config: The action's bounds.
    """
    residuals, scale = (steps_rad - CARRY_S * qvel) / GAIN, config.action_scale_rad
    residuals[:, _LAST_JOINT] = np.clip(residuals[:, _LAST_JOINT], -scale, scale)
    largest = np.abs(residuals).max(axis=-1, keepdims=True)
    return residuals * np.minimum(1.0, scale / np.maximum(largest, 1e-9))
