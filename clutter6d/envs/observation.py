"""What a policy sees (paper, Table "Summary of our MDP components"), in NumPy or torch (:mod:`clutter6d.arrays`)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Generic, TypedDict

import numpy as np
from jaxtyping import Float, Float32

from clutter6d.arrays import Array, namespace
from clutter6d.assets.asset import SURFACE_POINTS
from clutter6d.envs.action import joint_to_hand_velocity
from clutter6d.envs.point_cloud import (
    ENVIRONMENT_POINTS,
    POINT_FEATURES,
    PointClouds,
    RigidMotion,
    Rows,
    SceneClouds,
    free_body_motion,
    motion_in_world,
    point_clouds,
)
from clutter6d.geometry import Pose, motion_between, rotation_6d
from clutter6d.physics import TABLE_FRICTION
from clutter6d.sim.end_effector import END_EFFECTOR_POINTS
from clutter6d.sim.kinematics import HandKinematics, hand_kinematics
from clutter6d.sim.robot import FINGER_FRICTION
from clutter6d.sim.scene_model import SceneModel

CloudMaker = Callable[[SceneClouds[Array], RigidMotion[Array], RigidMotion[Array]], PointClouds[Array]]
"""Makes the point clouds from canonical points, the objects' and the hands' motion."""


class Observation(TypedDict, Generic[Array]):
    """One row a slot, float32; metres, kilograms, seconds, radians; world frame.

    A point's features are ``x y z``, its share of the object's mass (mass over number of points), and its velocity as
    a point of the rigid body. Rotations are in 6-D: the first two columns of the matrix.

    Attributes:
        object_points: Canonical surface points of the target.
        environment_points: Of all obstacles' points, the 512 nearest to the target's centroid, in the obstacles' order.
        end_effector_points: Canonical surface points of the hand and the fingers.
        hand_state: Position and rotation of the hand's frame.
        joint_state: Joint angles, then joint velocities.
        relative_goal: From the target's pose to its goal, in world axes: displacement of its origin, and turn about it.
            The goal in the target's own frame, which the paper's table may mean as well, would not say which way to
            push: nothing else in the observation tells how that frame lies in the world.
        physics_parameters: Privileged: target's mass, target's, hand's and table's friction, target's restitution.
        previous_action: The residual the policy asked for one step ago; zero at first.
    """

    object_points: Float32[Array, "slot 512 7"]
    environment_points: Float32[Array, "slot 512 7"]
    end_effector_points: Float32[Array, "slot 256 7"]
    hand_state: Float32[Array, "slot 9"]
    joint_state: Float32[Array, "slot 14"]
    relative_goal: Float32[Array, "slot 9"]
    physics_parameters: Float32[Array, "slot 5"]
    previous_action: Float32[Array, "slot 7"]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class BodyState(Generic[Array]):
    """Where everything is and how it moves; rows are slots, the target is the first object.

    Attributes:
        arm_qpos: Joint angles [rad].
        arm_qvel: Joint velocities [rad/s].
        object_poses: Poses of all objects.
        object_velocities: Linear velocity in the world frame, angular velocity in the object's own.
    """

    arm_qpos: Float[Array, "slot 7"]
    arm_qvel: Float[Array, "slot 7"]
    object_poses: Float[Array, "slot object 7"]
    object_velocities: Float[Array, "slot object 6"]

    def __getitem__(self, rows: Rows) -> "BodyState[Array]":
        """The state of some slots."""
        return BodyState(
            arm_qpos=self.arm_qpos[rows],
            arm_qvel=self.arm_qvel[rows],
            object_poses=self.object_poses[rows],
            object_velocities=self.object_velocities[rows],
        )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TaskArrays(Generic[Array]):
    """What an observation needs to know of each slot's scene and task.

    Attributes:
        clouds: Canonical points of all objects.
        goals: Goal poses of the targets.
        physics: The physics parameters of the observation.
    """

    clouds: SceneClouds[Array]
    goals: Float[Array, "slot 7"]
    physics: Float32[Array, "slot 5"]

    @classmethod
    def allocate(cls, slots: int, objects: int) -> "TaskArrays[np.ndarray]":
        """Arrays of slots without a task yet."""
        return TaskArrays(
            clouds=SceneClouds.allocate(slots, objects),
            goals=np.tile([0.0, 0, 0, 1, 0, 0, 0], (slots, 1)),
            physics=np.zeros((slots, 5), dtype=np.float32),
        )

    def load(self, slot: int, scene: SceneModel, goal: Pose) -> None:
        """Take over a slot's scene and goal; MuJoCo's soft contacts have no coefficient of restitution, so it is 0."""
        self.clouds.load(slot, scene)
        self.goals[slot] = goal.as_row()
        self.physics[slot] = (
            scene.object_masses_kg()[0],
            scene.object_frictions()[0],
            FINGER_FRICTION[0],
            TABLE_FRICTION,
            0.0,
        )

    def __getitem__(self, rows: Rows) -> "TaskArrays[Array]":
        """The arrays of some slots."""
        return TaskArrays(clouds=self.clouds[rows], goals=self.goals[rows], physics=self.physics[rows])


OBSERVATION_SHAPES: Final = {
    "object_points": (SURFACE_POINTS, POINT_FEATURES),
    "environment_points": (ENVIRONMENT_POINTS, POINT_FEATURES),
    "end_effector_points": (END_EFFECTOR_POINTS, POINT_FEATURES),
    "hand_state": (9,),
    "joint_state": (14,),
    "relative_goal": (9,),
    "physics_parameters": (5,),
    "previous_action": (7,),
}
"""Shape of one slot's row of each entry of an :class:`Observation`."""


def make_observation(
    state: BodyState[Array],
    task: TaskArrays[Array],
    previous_action: Float32[Array, "slot 7"],
    *,
    hand: HandKinematics[Array] | None = None,
    make_clouds: CloudMaker[Array] = point_clouds,
) -> Observation[Array]:
    """The observation of slots; a slot's rows do not depend on the others.

    Args:
        state: Where everything is.
        task: Scenes and goals of the same slots.
        previous_action: The residuals asked for one step ago [rad].
        hand: The hands' kinematics at ``state``, if they are known already.
        make_clouds: Another implementation of :func:`clutter6d.envs.point_cloud.point_clouds`.
    """
    xp = namespace(state.arm_qpos)
    hand = hand or hand_kinematics(state.arm_qpos)
    twist = joint_to_hand_velocity(hand.jacobian, state.arm_qvel)
    objects = free_body_motion(state.object_poses, state.object_velocities)
    clouds = make_clouds(task.clouds, objects, motion_in_world(hand.pose, twist[:, :3], twist[:, 3:]))
    return Observation(
        object_points=clouds.target,
        environment_points=clouds.environment,
        end_effector_points=clouds.hand,
        hand_state=_position_and_rotation(hand.pose),
        joint_state=xp.astype(xp.concat([state.arm_qpos, state.arm_qvel], axis=1), xp.float32),
        relative_goal=_position_and_rotation(motion_between(state.object_poses[:, 0], task.goals)),
        physics_parameters=xp.asarray(task.physics, copy=True),
        previous_action=xp.asarray(previous_action, copy=True),
    )


def _position_and_rotation(pose: Float[Array, "slot 7"]) -> Float32[Array, "slot 9"]:
    xp = namespace(pose)
    return xp.astype(xp.concat([pose[:, :3], rotation_6d(pose[:, 3:])], axis=1), xp.float32)
