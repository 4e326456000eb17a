"""What rollouts cost; pure functions of poses, row by row."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from clutter6d.envs.termination import goal_errors
from clutter6d.geometry import quat_conjugate, quat_multiply, transform_points
from dapl_baselines.planners.config import CostConfig


def goal_cost(
    target_poses: Float64[np.ndarray, "sample 7"],
    goal: Float64[np.ndarray, "*#sample 7"],
    rotation_weight_per_rad: float,
    config: CostConfig,
) -> Float64[np.ndarray, "sample"]:
    """Price of the distance to the goal, or to each row's own, zero within the dead bands of both errors."""
    errors = goal_errors(target_poses, np.broadcast_to(goal, target_poses.shape))
    position = np.maximum(errors.position_m - config.position_dead_band_m, 0.0)
    rotation = np.maximum(rotation_cost_rad(target_poses[:, 3:], goal[..., 3:]) - config.rotation_dead_band_rad, 0.0)
    return config.position_weight_per_m * position + rotation_weight_per_rad * rotation


def rotation_cost_rad(
    quats: Float64[np.ndarray, "sample 4"], goal_quat: Float64[np.ndarray, "*#sample 4"]
) -> Float64[np.ndarray, "sample"]:
    """Tilt and turn about the vertical, ``hypot(tilt, turn cos^2(tilt / 2))`` [rad]; near the goal, the rotation error.

    The turn fades as the tilt grows: while an object lies on a wrong face it is no use to turn it, and it must be free
    to tip over whichever edge is at hand.
    """
    errors = tilt_and_turn(quats, goal_quat)
    return np.hypot(errors.tilt_rad, errors.turn_rad * errors.upright)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TiltAndTurn:
    """Rotations as a turn about a horizontal axis and one about the vertical, as far as each leads; none negative.

    Attributes:
        tilt_rad: About a horizontal axis.
        turn_rad: About the vertical.
        upright: ``cos^2(tilt / 2)``: 1 on the right face, 0 upside down.
    """

    tilt_rad: Float64[np.ndarray, "sample"]
    turn_rad: Float64[np.ndarray, "sample"]
    upright: Float64[np.ndarray, "sample"]


def tilt_and_turn(quats: Float64[np.ndarray, "sample 4"], goal_quat: Float64[np.ndarray, "*#sample 4"]) -> TiltAndTurn:
    """What leads from each goal to each rotation."""
    turn = quat_multiply(quats, quat_conjugate(goal_quat))
    cosine = np.hypot(turn[:, 0], turn[:, 3])
    return TiltAndTurn(
        tilt_rad=2 * np.arctan2(np.hypot(turn[:, 1], turn[:, 2]), cosine),
        turn_rad=2 * np.arctan2(np.abs(turn[:, 3]), np.abs(turn[:, 0])),
        upright=cosine**2,
    )


def reach_cost(
    tips: Float64[np.ndarray, "sample 3"],
    target_poses: Float64[np.ndarray, "sample 7"],
    surface: Float64[np.ndarray, "point 3"],
    config: CostConfig,
) -> Float64[np.ndarray, "sample"]:
    """Price of the distance from the finger tips to the target's surface."""
    offset = transform_points(target_poses, surface) - tips[:, None]
    nearest = np.sqrt((offset**2).sum(axis=-1)).min(axis=-1)
    return config.reach_weight_per_m * np.maximum(nearest - config.reach_free_m, 0.0)


def disturbance_cost(
    object_poses: Float64[np.ndarray, "sample object 7"],
    start_poses: Float64[np.ndarray, "object 7"],
    config: CostConfig,
) -> Float64[np.ndarray, "sample"]:
    """Price of the mean displacement of the other objects since the episode's start; a scene may have none."""
    if len(start_poses) == 1:
        return np.zeros(len(object_poses))
    offset = object_poses[:, 1:, :3] - start_poses[1:, :3]
    return config.disturbance_weight_per_m * np.sqrt((offset**2).sum(axis=-1)).mean(axis=-1)


def fall_cost(
    object_poses: Float64[np.ndarray, "sample object 7"], config: CostConfig
) -> Float64[np.ndarray, "sample"]:
    """Penalty for a target near the edge of the table, and for any object below the table top."""
    is_near_edge = (np.abs(object_poses[:, 0, :2]) > np.array(config.edge_m)).any(axis=-1)
    is_below = (object_poses[..., 2] < -0.02).any(axis=-1)
    return np.where(is_near_edge, config.fall_penalty, 0.0) + np.where(is_below, config.fall_penalty, 0.0)
