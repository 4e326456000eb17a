"""What a push is judged by: the target, how it moves, what stands around it, and where the hand is."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Final, Generic

import numpy as np
import torch
from jaxtyping import Float, Float64, Int
from torch import Tensor

from clutter6d.arrays import Array
from clutter6d.assets.asset import SURFACE_POINTS
from clutter6d.envs.action import joint_to_hand_velocity
from clutter6d.envs.observation import BodyState
from clutter6d.geometry import quat_from_matrix, quat_to_matrix, rotate, transform_points
from clutter6d.sim.kinematics import HandKinematics
from clutter6d.sim.scene_model import SceneModel
from dapl_baselines.planners.hand_servo import tip_positions
from dapl_baselines.push_policy.tracker import POINTING_DOWN

POINTS: Final = 64
EVERY_POINT: Final = SURFACE_POINTS // POINTS
"""One of so many surface points of an object that is not the target is kept, to fly over it."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PushState(Generic[Array]):
    """States, one row each; world frame, metres, kilograms, seconds.

    Attributes:
        poses: The targets' poses.
        velocities: Their linear, then angular velocities, world axes.
        obstacles: Of each other object position, radius of a ball around it, and mass.
        physics: The targets' mass and friction.
        tips: Where the finger tips are.
        tip_velocities: How the hand's frame moves.
        hands: How the hands are held, see :data:`dapl_baselines.push_policy.push.HAND`.
    """

    poses: Float[Array, "row 7"]
    velocities: Float[Array, "row 6"]
    obstacles: Float[Array, "row obstacle 5"]
    physics: Float[Array, "row 2"]
    tips: Float[Array, "row 3"]
    tip_velocities: Float[Array, "row 3"]
    hands: Float[Array, "row 4"]

    def rows(self, rows: Int[np.ndarray, "row"]) -> "PushState[Array]":
        """Some of the states, a copy."""
        return PushState(**{name: getattr(self, name)[rows] for name in STATE_FIELDS})

    def to_tensors(self) -> "PushState[Tensor]":
        """For a network."""
        return PushState(**{name: to_tensor(getattr(self, name)) for name in STATE_FIELDS})


def to_tensor(array: np.ndarray) -> Tensor:
    """An array for a network, as float32."""
    return torch.from_numpy(np.asarray(array, dtype=np.float32))


STATE_FIELDS = tuple(field.name for field in fields(PushState))


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SceneFacts:
    """What does not change in an episode; one row a slot, the target first of the objects.

    Attributes:
        radii: Of balls around the objects' origins [m].
        surfaces: Surface points of all objects but the targets, in their own frames [m].
        masses: [kg].
        frictions: Of the targets.
    """

    radii: Float64[np.ndarray, "slot object"]
    surfaces: Float64[np.ndarray, "slot obstacle point 3"]
    masses: Float64[np.ndarray, "slot object"]
    frictions: Float64[np.ndarray, "slot"]

    @classmethod
    def of(cls, scenes: Sequence[SceneModel]) -> "SceneFacts":
        """The facts of scenes, a slot each."""
        radii = [[np.sqrt((asset.surface_points**2).sum(axis=-1).max()) for asset in scene.assets] for scene in scenes]
        surfaces = np.array([[asset.surface_points[::EVERY_POINT] for asset in scene.assets[1:]] for scene in scenes])
        return cls(
            radii=np.array(radii, dtype=np.float64),
            surfaces=surfaces.reshape(len(scenes), -1, POINTS, 3).astype(np.float64),
            masses=np.stack([scene.object_masses_kg() for scene in scenes]),
            frictions=np.array([scene.object_frictions()[0] for scene in scenes]),
        )

    def put(self, slots: np.ndarray, facts: "SceneFacts") -> None:
        """Take over those of some slots."""
        self.radii[slots], self.masses[slots] = facts.radii, facts.masses
        self.frictions[slots], self.surfaces[slots] = facts.frictions, facts.surfaces

    def placed_surfaces(
        self, object_poses: Float64[np.ndarray, "slot object 7"]
    ) -> Float64[np.ndarray, "slot point 3"]:
        """Where the surface points are, world frame [m]."""
        placed = transform_points(object_poses[:, 1:].reshape(-1, 7), self.surfaces.reshape(-1, POINTS, 3))
        return placed.reshape(len(object_poses), -1, 3)


def read_push_state(
    bodies: BodyState[np.ndarray], hand: HandKinematics[np.ndarray], facts: SceneFacts
) -> PushState[np.ndarray]:
    """The states of slots, as the simulation knows them.

    Args:
        bodies: Where everything is and how it moves.
        hand: The hands' kinematics there.
        facts: Of the same slots.
    """
    poses, moves = bodies.object_poses[:, 0], bodies.object_velocities[:, 0]
    tips, tip_velocities, hands = hand_parts(hand, bodies.arm_qvel)
    around = [bodies.object_poses[:, 1:, :3], facts.radii[:, 1:, None], facts.masses[:, 1:, None]]
    return PushState(
        poses=poses.copy(),
        velocities=np.concatenate([moves[:, :3], rotate(poses[:, 3:], moves[:, 3:])], axis=1),
        obstacles=np.concatenate(around, axis=2),
        physics=np.stack([facts.masses[:, 0], facts.frictions], axis=1),
        tips=tips,
        tip_velocities=tip_velocities,
        hands=hands,
    )


def hand_parts(
    hand: HandKinematics[np.ndarray], qvel: Float64[np.ndarray, "row 7"]
) -> tuple[Float64[np.ndarray, "row 3"], Float64[np.ndarray, "row 3"], Float64[np.ndarray, "row 4"]]:
    """A state's ``tips``, ``tip_velocities`` and ``hands``, from kinematics and joint velocities [rad/s]."""
    return (
        tip_positions(hand.pose),
        joint_to_hand_velocity(hand.jacobian[:, :3], qvel),
        quat_from_matrix(quat_to_matrix(hand.pose[:, 3:]) @ POINTING_DOWN),
    )
