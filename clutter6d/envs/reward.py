"""The reward (paper, "Reward Function"); pure functions of poses, in NumPy or torch (:mod:`clutter6d.arrays`).

Terms are summed as the paper writes them, not multiplied by the control step as Isaac Lab does.
"""

from dataclasses import dataclass
from math import pi
from typing import Generic

from jaxtyping import Float

from clutter6d.arrays import Array, constant, namespace
from clutter6d.geometry import rotation_error_rad, transform_points
from clutter6d.sim.end_effector import FINGERS
from clutter6d.sim.robot_facts import TIP_OFFSET_M

_FINGER_TIPS_M = tuple((0.0, float(finger.centre_m[1]), TIP_OFFSET_M) for finger in FINGERS)


@dataclass(frozen=True, kw_only=True, slots=True)
class RewardConfig:
    """Scales and weights; the paper's, where it gives them.

    Attributes:
        proximity_scale_m: Scale of the distance between a finger and the target.
        coarse_scale: Scale of the pose error, coarse term; metres, with 5 rad to the metre.
        fine_scale: Scale of the pose error, fine term.
        gate_m: Distance of finger and target below which the goal terms count.
        rotation_weight_m_rad: Metres that one radian of rotation error is worth.
        position_tolerance_m: Success term: planar distance; the paper's appendix uses the plane here.
        rotation_tolerance_rad: Success term: rotation error.
        obstacle_distance_m: Mean displacement of the obstacles that counts as full; not in the paper, twice its own
            threshold of a large displacement.
        obstacle_angle_rad: Mean rotation that counts as full; not in the paper, its own threshold of a large one.
        proximity_weight: Weight of the proximity term.
        coarse_weight: Weight of the coarse goal term.
        fine_weight: Weight of the fine goal term.
        success_weight: Weight of the success term.
    """

    proximity_scale_m: float = 0.1
    coarse_scale: float = 0.6
    fine_scale: float = 0.3
    gate_m: float = 0.1
    rotation_weight_m_rad: float = 0.2
    position_tolerance_m: float = 0.05
    rotation_tolerance_rad: float = 0.1
    obstacle_distance_m: float = 0.10
    obstacle_angle_rad: float = pi / 4
    proximity_weight: float = 1.0
    coarse_weight: float = 5.0
    fine_weight: float = 16.0
    success_weight: float = 2000.0


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class RewardTerms(Generic[Array]):
    """The weighted terms of one control step; ``total`` is their sum."""

    proximity: Float[Array, "slot"]
    coarse: Float[Array, "slot"]
    fine: Float[Array, "slot"]
    success: Float[Array, "slot"]

    @property
    def total(self) -> Float[Array, "slot"]:
        """The reward."""
        return self.proximity + self.coarse + self.fine + self.success


def finger_tips(hand_poses: Float[Array, "slot 7"]) -> Float[Array, "slot 2 3"]:
    """Positions of the left and the right finger tip in the world [m]."""
    return transform_points(hand_poses, constant(_FINGER_TIPS_M, hand_poses))


def compute_reward(
    object_poses: Float[Array, "slot object 7"],
    start_poses: Float[Array, "slot object 7"],
    goals: Float[Array, "slot 7"],
    fingers: Float[Array, "slot 2 3"],
    config: RewardConfig,
) -> RewardTerms[Array]:
    """The reward of the state at a control step's end.

    Args:
        object_poses: Current poses; the target is the first object.
        start_poses: Poses at the episode's start.
        goals: Goal poses of the targets.
        fingers: Positions of the left and the right finger tip [m].
        config: Scales and weights.
    """
    xp = namespace(object_poses)
    target = object_poses[:, 0]
    finger_distance = xp.min(_norm(fingers - target[:, None, :3]), axis=1)
    rotation = rotation_error_rad(target[:, 3:], goals[:, 3:])
    error = _norm(target[:, :3] - goals[:, :3]) + config.rotation_weight_m_rad * rotation
    is_near = finger_distance < config.gate_m
    is_placed = (_norm(target[:, :2] - goals[:, :2]) < config.position_tolerance_m) & (
        rotation < config.rotation_tolerance_rad
    )
    factor = disturbance_factor(object_poses[:, 1:], start_poses[:, 1:], config)
    return RewardTerms(
        proximity=config.proximity_weight * (1 - xp.tanh(finger_distance / config.proximity_scale_m)),
        coarse=config.coarse_weight * (is_near * (1 - xp.tanh(error / config.coarse_scale))),
        fine=config.fine_weight * (is_near * (1 - xp.tanh(error / config.fine_scale))),
        success=config.success_weight * (is_placed * factor),
    )


def disturbance_factor(
    obstacle_poses: Float[Array, "slot obstacle 7"],
    start_poses: Float[Array, "slot obstacle 7"],
    config: RewardConfig,
) -> Float[Array, "slot"]:
    """The factor in [0.5, 1] by which moved obstacles reduce a success (paper, "Obstacle Motion Penalty")."""
    xp = namespace(obstacle_poses)
    if obstacle_poses.shape[1] == 0:
        return xp.ones_like(xp.sum(obstacle_poses, axis=(1, 2)))
    distance = xp.mean(_norm(obstacle_poses[..., :3] - start_poses[..., :3]), axis=1)
    angle = xp.mean(rotation_error_rad(obstacle_poses[..., 3:], start_poses[..., 3:]), axis=1)
    moved = xp.minimum(distance / config.obstacle_distance_m, 1.0)
    turned = xp.minimum(angle / config.obstacle_angle_rad, 1.0)
    return 1 - 0.5 * (moved + turned) / 2


def _norm(vectors: Float[Array, "*n axis"]) -> Float[Array, "*n"]:
    xp = namespace(vectors)
    return xp.sqrt(xp.sum(vectors * vectors, axis=-1))
