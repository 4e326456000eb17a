"""How far a target is from its goal, a price that falls on the way there: the planner's, and a margin at the edge."""

from typing import Final

import numpy as np
from jaxtyping import Float, Float64

from dapl_baselines.planners.config import CostConfig, PlannerConfig
from dapl_baselines.planners.costs import goal_cost

EDGE_M: Final = np.array([0.36, 0.55])
EDGE_WEIGHT_PER_M: Final = 4.0
"""Beyond these |x|, |y|, 14 cm and 15 cm from the table's edge, a target comes nearer to falling off."""

_ROTATION_WEIGHT_PER_RAD: Final = PlannerConfig().rotation_weights_per_rad[0]


def goal_potential(poses: Float[np.ndarray, "row 7"], goals: Float[np.ndarray, "row 7"]) -> Float64[np.ndarray, "row"]:
    """The price of each row: 4 a metre and 0.8 a radian beyond the dead bands, and 4 a metre beyond the margin."""
    poses, goals = poses.astype(np.float64), goals.astype(np.float64)
    beyond = np.maximum(np.abs(poses[:, :2]) - EDGE_M, 0.0).sum(axis=1)
    return goal_cost(poses, goals, _ROTATION_WEIGHT_PER_RAD, CostConfig()) + EDGE_WEIGHT_PER_M * beyond
