"""What a policy sees (paper, Table "Summary of our MDP components")."""

from dataclasses import dataclass
from typing import Final, TypedDict, cast

import numpy as np
from jaxtyping import Float32, Float64

from clutter6d.assets.asset import SURFACE_POINTS
from clutter6d.envs.action import joint_to_hand_velocity
from clutter6d.envs.point_cloud import (
    ENVIRONMENT_POINTS,
    POINT_FEATURES,
    RigidMotion,
    Rows,
    SceneClouds,
    free_body_motion,
    object_features,
    world_points,
    write_features,
)
from clutter6d.geometry import Pose, quat_to_matrix, relative_pose, rotation_6d
from clutter6d.physics import TABLE_FRICTION
from clutter6d.sim.end_effector import END_EFFECTOR_POINTS
from clutter6d.sim.robot import FINGER_FRICTION, end_effector_points, hand_jacobian, hand_pose
from clutter6d.sim.robot_facts import FINGER, HAND
from clutter6d.sim.scene_model import SceneModel

HAND_MASS_KG: Final = HAND.mass_kg + 2 * FINGER.mass_kg


class Observation(TypedDict):
    """One row a slot, float32; metres, kilograms, seconds, radians; world frame.

    A point's features are ``x y z``, its share of the object's mass (mass over number of points), and its velocity as
    a point of the rigid body. Rotations are in 6-D: the first two columns of the matrix.

    Attributes:
        object_points: Canonical surface points of the target.
        environment_points: Of all obstacles' points, the 512 nearest to the target's centroid, in the obstacles' order.
        end_effector_points: Canonical surface points of the hand and the fingers.
        hand_state: Position and rotation of the hand's frame.
        joint_state: Joint angles, then joint velocities.
        relative_goal: Goal pose in the target's frame: translation and rotation.
        physics_parameters: Privileged: target's mass, target's, hand's and table's friction, target's restitution.
        previous_action: The residual the policy asked for one step ago; zero at first.
    """

    object_points: Float32[np.ndarray, "slot 512 7"]
    environment_points: Float32[np.ndarray, "slot 512 7"]
    end_effector_points: Float32[np.ndarray, "slot 256 7"]
    hand_state: Float32[np.ndarray, "slot 9"]
    joint_state: Float32[np.ndarray, "slot 14"]
    relative_goal: Float32[np.ndarray, "slot 9"]
    physics_parameters: Float32[np.ndarray, "slot 5"]
    previous_action: Float32[np.ndarray, "slot 7"]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class BodyState:
    """Where everything is and how it moves; rows are slots, the target is the first object.

    Attributes:
        arm_qpos: Joint angles [rad].
        arm_qvel: Joint velocities [rad/s].
        object_poses: Poses of all objects.
        object_velocities: Linear velocity in the world frame, angular velocity in the object's own.
    """

    arm_qpos: Float64[np.ndarray, "slot 7"]
    arm_qvel: Float64[np.ndarray, "slot 7"]
    object_poses: Float64[np.ndarray, "slot object 7"]
    object_velocities: Float64[np.ndarray, "slot object 6"]

    def __getitem__(self, rows: Rows) -> "BodyState":
        """The state of some slots."""
        return BodyState(
            arm_qpos=self.arm_qpos[rows],
            arm_qvel=self.arm_qvel[rows],
            object_poses=self.object_poses[rows],
            object_velocities=self.object_velocities[rows],
        )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TaskArrays:
    """What an observation needs to know of each slot's scene and task.

    Attributes:
        clouds: Canonical points of all objects.
        goals: Goal poses of the targets.
        physics: The physics parameters of the observation.
    """

    clouds: SceneClouds
    goals: Float64[np.ndarray, "slot 7"]
    physics: Float32[np.ndarray, "slot 5"]

    @classmethod
    def allocate(cls, slots: int, objects: int) -> "TaskArrays":
        """Arrays of slots without a task yet."""
        return cls(
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

    def __getitem__(self, rows: Rows) -> "TaskArrays":
        """The arrays of some slots."""
        return TaskArrays(clouds=self.clouds[rows], goals=self.goals[rows], physics=self.physics[rows])


def allocate_observation(slots: int) -> Observation:
    """An observation to be filled."""
    return Observation(
        object_points=np.empty((slots, SURFACE_POINTS, POINT_FEATURES), dtype=np.float32),
        environment_points=np.empty((slots, ENVIRONMENT_POINTS, POINT_FEATURES), dtype=np.float32),
        end_effector_points=np.empty((slots, END_EFFECTOR_POINTS, POINT_FEATURES), dtype=np.float32),
        hand_state=np.empty((slots, 9), dtype=np.float32),
        joint_state=np.empty((slots, 14), dtype=np.float32),
        relative_goal=np.empty((slots, 9), dtype=np.float32),
        physics_parameters=np.empty((slots, 5), dtype=np.float32),
        previous_action=np.empty((slots, 7), dtype=np.float32),
    )


def fill_observation(
    out: Observation, state: BodyState, task: TaskArrays, previous_action: Float32[np.ndarray, "slot 7"]
) -> None:
    """Fill the observation of slots; a slot's rows do not depend on the others.

    Args:
        out: Receives the observation; one row for each row of ``state``.
        state: Where everything is.
        task: Scenes and goals of the same slots.
        previous_action: The residuals asked for one step ago [rad].
    """
    motion = free_body_motion(state.object_poses, state.object_velocities)
    object_features(task.clouds, motion, out["object_points"], out["environment_points"])
    hand = hand_pose(state.arm_qpos)
    _fill_end_effector(out["end_effector_points"], hand, state)
    out["hand_state"][:] = _position_and_rotation(hand)
    out["joint_state"][:, :7] = state.arm_qpos
    out["joint_state"][:, 7:] = state.arm_qvel
    out["relative_goal"][:] = _position_and_rotation(relative_pose(state.object_poses[:, 0], task.goals))
    out["physics_parameters"][:] = task.physics
    out["previous_action"][:] = previous_action


def observation_rows(observation: Observation, rows: Rows) -> Observation:
    """Views (or copies, for an array of rows) of some rows."""
    return cast(Observation, {name: value[rows] for name, value in cast(dict[str, np.ndarray], observation).items()})


def _fill_end_effector(
    out: Float32[np.ndarray, "slot 256 7"], hand: Float64[np.ndarray, "slot 7"], state: BodyState
) -> None:
    twist = joint_to_hand_velocity(hand_jacobian(state.arm_qpos), state.arm_qvel).astype(np.float32)
    motion = RigidMotion(
        rotation=quat_to_matrix(hand[:, 3:]).astype(np.float32),
        position=hand[:, :3].astype(np.float32),
        linear_velocity=twist[:, :3],
        angular_velocity=twist[:, 3:],
    )
    points = np.broadcast_to(end_effector_points().T, (len(hand), 3, END_EFFECTOR_POINTS)).copy()
    point_mass = np.full((1, 1), HAND_MASS_KG / END_EFFECTOR_POINTS, dtype=np.float32)
    write_features(out, world_points(points, motion), point_mass, motion)


def _position_and_rotation(pose: Float64[np.ndarray, "slot 7"]) -> Float64[np.ndarray, "slot 9"]:
    return np.concatenate([pose[:, :3], rotation_6d(pose[:, 3:])], axis=1)
