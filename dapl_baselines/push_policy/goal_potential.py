"""How far a target is from its goal, as a price that falls on the way there.

The face that an object lies on is what is hardest to change, so it has a price of its own. While the face is wrong, the
turn about the vertical counts as the mean of all turns: an object that tips over onto the right face, however it is
turned then, has come nearer. The planner's price (:func:`dapl_baselines.planners.costs.goal_cost`) takes the turn in by
and by, and can rise there.
"""

from typing import Final

import numpy as np
from jaxtyping import Float, Float64

from dapl_baselines.planners.config import CostConfig
from dapl_baselines.planners.costs import tilt_and_turn

EDGE_M: Final = np.array([0.36, 0.55])
EDGE_WEIGHT_PER_M: Final = 4.0
"""Beyond these |x|, |y|, 14 cm and 15 cm from the table's edge, a target comes nearer to falling off."""
TILT_WEIGHT_PER_RAD: Final = 1.0
TURN_WEIGHT_PER_RAD: Final = 0.5
MEAN_TURN_RAD: Final = np.pi / 2

_BANDS: Final = CostConfig()


def goal_potential(poses: Float[np.ndarray, "row 7"], goals: Float[np.ndarray, "row 7"]) -> Float64[np.ndarray, "row"]:
    """The price of each row: of distance, tilt and turn beyond dead bands, and of what is beyond the margin."""
    poses, goals = poses.astype(np.float64), goals.astype(np.float64)
    distance = np.sqrt(((poses[:, :3] - goals[:, :3]) ** 2).sum(axis=-1))
    errors, band = tilt_and_turn(poses[:, 3:], goals[:, 3:]), _BANDS.rotation_dead_band_rad
    turn = errors.upright * np.maximum(errors.turn_rad - band, 0.0) + (1 - errors.upright) * MEAN_TURN_RAD
    beyond = np.maximum(np.abs(poses[:, :2]) - EDGE_M, 0.0).sum(axis=1)
    return (
        _BANDS.position_weight_per_m * np.maximum(distance - _BANDS.position_dead_band_m, 0.0)
        + TILT_WEIGHT_PER_RAD * np.maximum(errors.tilt_rad - band, 0.0)
        + TURN_WEIGHT_PER_RAD * turn
        + EDGE_WEIGHT_PER_M * beyond
    )
