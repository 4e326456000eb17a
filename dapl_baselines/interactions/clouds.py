"""What was seen before and after a control step, rebuilt from states: the same points at both times."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64

from clutter6d.envs.action import joint_to_hand_velocity
from clutter6d.envs.observation import BodyState
from clutter6d.envs.point_cloud import (
    PointClouds,
    RigidMotion,
    SceneClouds,
    follow_points,
    free_body_motion,
    motion_in_world,
)
from clutter6d.envs.point_kernel import compiled_nearest_points
from clutter6d.sim.kinematics import hand_kinematics


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class CloudPairs:
    """Clouds before and after a control step; 512 points of the target, 512 of the environment, 256 of the hand.

    Attributes:
        now: What is seen, to the bit as in the observation: ``x y z`` [m], share of the mass [kg], velocity [m/s].
        later: The same points 0.1 s later; the environment's are those that were nearest to the target before.
        flow: The end-effector's flow, the paper's a_t: mean displacement of the hand's points in the step [m]. It is
            what the hand did, not what it was told to do.
    """

    now: Float32[np.ndarray, "row 1280 7"]
    later: Float32[np.ndarray, "row 1280 7"]
    flow: Float32[np.ndarray, "row 3"]


def make_cloud_pairs(
    scenes: SceneClouds[np.ndarray],
    now: BodyState[np.ndarray],
    later: BodyState[np.ndarray],
    *,
    yaw_rad: Float64[np.ndarray, "row"] | None = None,
) -> CloudPairs:
    """Clouds of many transitions at once; a row does not depend on the others.

    Args:
        scenes: Canonical points of each row's scene.
        now: States before the step.
        later: States after it.
        yaw_rad: Turns each row's world about the vertical axis through the table's centre.
    """
    objects, hands = _motions(now, yaw_rad)
    objects_later, hands_later = _motions(later, yaw_rad)
    chosen = compiled_nearest_points(scenes, objects)
    before = _joined(follow_points(scenes, objects, hands, chosen))
    after = _joined(follow_points(scenes, objects_later, hands_later, chosen))
    hand = slice(-scenes.hand_points.shape[-1], None)
    flow = (after[:, hand, :3] - before[:, hand, :3]).mean(axis=1)
    return CloudPairs(now=before, later=after, flow=flow)


def _motions(
    state: BodyState[np.ndarray], yaw_rad: Float64[np.ndarray, "row"] | None
) -> tuple[RigidMotion[np.ndarray], RigidMotion[np.ndarray]]:
    """Motion of the objects and of the hand."""
    hand = hand_kinematics(state.arm_qpos)
    twist = joint_to_hand_velocity(hand.jacobian, state.arm_qvel)
    objects = free_body_motion(state.object_poses, state.object_velocities)
    hands = motion_in_world(hand.pose, twist[:, :3], twist[:, 3:])
    if yaw_rad is None:
        return objects, hands
    return _turned(objects, yaw_rad[:, None]), _turned(hands, yaw_rad)


def _turned(motion: RigidMotion[np.ndarray], yaw_rad: Float64[np.ndarray, "*frame"]) -> RigidMotion[np.ndarray]:
    cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
    zero, one = np.zeros_like(cosine), np.ones_like(cosine)
    rows = [np.stack(row, axis=-1) for row in ((cosine, -sine, zero), (sine, cosine, zero), (zero, zero, one))]
    turn = np.stack(rows, axis=-2).astype(np.float32)

    def turned(vectors: np.ndarray) -> np.ndarray:
        return (turn @ vectors[..., None])[..., 0]

    return RigidMotion(
        rotation=turn @ motion.rotation,
        position=turned(motion.position),
        linear_velocity=turned(motion.linear_velocity),
        angular_velocity=turned(motion.angular_velocity),
    )


def _joined(clouds: PointClouds[np.ndarray]) -> Float32[np.ndarray, "row 1280 7"]:
    return np.concatenate([clouds.target, clouds.environment, clouds.hand], axis=1)
