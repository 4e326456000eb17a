"""Point clouds of all objects and hands of all slots in one go: position, share of mass, velocity.

A point of a rigid body at ``p`` in the object frame is at ``R p + t`` and moves with ``R (w x p) + v``, where MuJoCo
keeps ``w`` in the object frame and ``v`` in the world frame. Every product is written out term by term in float32, so
that a slot's points are the same to the bit in any batch.

This is the readable form, for NumPy and torch (:mod:`clutter6d.arrays`). On the CPU the environments use
:mod:`clutter6d.envs.point_kernel`, which gives the same bits.
"""

from dataclasses import dataclass
from typing import Generic

import numpy as np
from jaxtyping import Float, Float32, Int

from clutter6d.arrays import Array, namespace
from clutter6d.errors import InvalidValueError
from clutter6d.geometry import cross, quat_to_matrix, rotate
from clutter6d.sim.end_effector import END_EFFECTOR_POINTS, end_effector_points
from clutter6d.sim.robot_facts import FINGER, HAND
from clutter6d.sim.scene_model import SceneModel

POINT_FEATURES = 7
ENVIRONMENT_POINTS = 512
HAND_POINT_MASS_KG = float(np.float32((HAND.mass_kg + 2 * FINGER.mass_kg) / END_EFFECTOR_POINTS))
Rows = slice | Int[np.ndarray, "row"]
"""Some of the slots."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class RigidMotion(Generic[Array]):
    """Rotation, position and velocity of rigid frames, to the world frame.

    Attributes:
        rotation: Rotation matrices.
        position: Positions of the frames' origins [m].
        linear_velocity: Velocities of the origins [m/s].
        angular_velocity: Angular velocities in the world frame [rad/s].
    """

    rotation: Float32[Array, "*frame 3 3"]
    position: Float32[Array, "*frame 3"]
    linear_velocity: Float32[Array, "*frame 3"]
    angular_velocity: Float32[Array, "*frame 3"]

    def __getitem__(self, key: tuple[slice, int | slice]) -> "RigidMotion[Array]":
        """The motion of some of the frames."""
        return RigidMotion(
            rotation=self.rotation[key],
            position=self.position[key],
            linear_velocity=self.linear_velocity[key],
            angular_velocity=self.angular_velocity[key],
        )

    @property
    def rest(self) -> Float32[Array, "*frame 3"]:
        """Velocity that a point of the frame would have at the world's origin: one at ``p`` adds ``w x p`` [m/s]."""
        return self.linear_velocity - cross(self.angular_velocity, self.position)


def free_body_motion(poses: Float[Array, "*frame 7"], velocities: Float[Array, "*frame 6"]) -> RigidMotion[Array]:
    """Motion of free bodies from their poses and MuJoCo's velocities (linear: world frame, angular: body frame)."""
    return motion_in_world(poses, velocities[..., :3], rotate(poses[..., 3:], velocities[..., 3:]))


def motion_in_world(
    poses: Float[Array, "*frame 7"], linear: Float[Array, "*frame 3"], angular: Float[Array, "*frame 3"]
) -> RigidMotion[Array]:
    """Motion of frames from their poses and velocities in the world frame."""
    xp = namespace(poses)
    return RigidMotion(
        rotation=xp.astype(quat_to_matrix(poses[..., 3:]), xp.float32),
        position=xp.astype(poses[..., :3], xp.float32),
        linear_velocity=xp.astype(linear, xp.float32),
        angular_velocity=xp.astype(angular, xp.float32),
    )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SceneClouds(Generic[Array]):
    """What the point clouds of slots are made from; constant while a slot keeps its scene.

    Attributes:
        points: Canonical surface points in the object frames, coordinates before points.
        point_mass: Each object's mass over its number of points [kg].
        target_centroid: Centroid of the target's points in its frame, as one column.
        hand_points: Canonical surface points of the hand and the fingers in the hand's frame; the same for all slots.
    """

    points: Float32[Array, "slot object 3 512"]
    point_mass: Float32[Array, "slot object"]
    target_centroid: Float32[Array, "slot 3 1"]
    hand_points: Float32[Array, "3 256"]

    @classmethod
    def allocate(cls, slots: int, objects: int) -> "SceneClouds[np.ndarray]":
        """Clouds of slots without a scene yet.

        Raises:
            InvalidValueError: There is no obstacle to take the environment's points from.
        """
        if objects < 2:
            raise InvalidValueError(f"an observation needs a target and at least one obstacle; got {objects} objects")
        return SceneClouds(
            points=np.zeros((slots, objects, 3, 512), dtype=np.float32),
            point_mass=np.zeros((slots, objects), dtype=np.float32),
            target_centroid=np.zeros((slots, 3, 1), dtype=np.float32),
            hand_points=np.ascontiguousarray(end_effector_points().T),
        )

    def load(self, slot: int, scene: SceneModel) -> None:
        """Take over a scene's points and masses."""
        for index, asset in enumerate(scene.assets):
            self.points[slot, index] = asset.surface_points.T
        self.point_mass[slot] = scene.object_masses_kg() / self.points.shape[-1]
        self.target_centroid[slot, :, 0] = scene.assets[0].surface_points.mean(axis=0, dtype=np.float64)

    def __getitem__(self, rows: Rows) -> "SceneClouds[Array]":
        """The clouds of some slots."""
        return SceneClouds(
            points=self.points[rows],
            point_mass=self.point_mass[rows],
            target_centroid=self.target_centroid[rows],
            hand_points=self.hand_points,
        )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PointClouds(Generic[Array]):
    """The three point clouds of an observation; features are ``x y z``, mass share, velocity.

    Attributes:
        target: Of each slot's first object.
        environment: Of the obstacle points nearest to the target's centroid, in the order of obstacles and points.
        hand: Of the hand and the fingers.
    """

    target: Float32[Array, "slot 512 7"]
    environment: Float32[Array, "slot 512 7"]
    hand: Float32[Array, "slot 256 7"]


def point_clouds(
    clouds: SceneClouds[Array], objects: RigidMotion[Array], hand: RigidMotion[Array]
) -> PointClouds[Array]:
    """The point clouds of all slots.

    Args:
        clouds: Canonical points; the target is each slot's first object.
        objects: Motion of all objects, with axes ``slot object``.
        hand: Motion of the hands, with axis ``slot``.
    """
    world = world_points(clouds.points, objects)
    return _clouds_of(clouds, world, objects, hand, _nearest(clouds, world, objects))


def nearest_points(clouds: SceneClouds[Array], objects: RigidMotion[Array]) -> Int[Array, "slot 512"]:
    """Which obstacle points are the environment's: those nearest to the target's centroid; of equals, the first.

    Returns:
        Indices of points, the obstacles' one after the other, ascending.
    """
    return _nearest(clouds, world_points(clouds.points, objects), objects)


def follow_points(
    clouds: SceneClouds[Array], objects: RigidMotion[Array], hand: RigidMotion[Array], chosen: Int[Array, "slot 512"]
) -> PointClouds[Array]:
    """The point clouds of all slots with given environment points, for instance those of an earlier state.

    Args:
        clouds: Canonical points; the target is each slot's first object.
        objects: Motion of all objects, with axes ``slot object``.
        hand: Motion of the hands, with axis ``slot``.
        chosen: What :func:`nearest_points` gave.
    """
    return _clouds_of(clouds, world_points(clouds.points, objects), objects, hand, chosen)


def _clouds_of(
    clouds: SceneClouds[Array],
    world: Float32[Array, "slot object 3 512"],
    objects: RigidMotion[Array],
    hand: RigidMotion[Array],
    chosen: Int[Array, "slot 512"],
) -> PointClouds[Array]:
    target = objects[:, 0]
    hand_mass = namespace(clouds.point_mass).full_like(clouds.point_mass[:, :1], HAND_POINT_MASS_KG)
    target_spin, hand_spin = target.angular_velocity[..., None], hand.angular_velocity[..., None]
    hand_world = world_points(clouds.hand_points, hand)
    return PointClouds(
        target=_features(world[:, 0], clouds.point_mass[:, :1], target.rest[..., None], target_spin),
        environment=_chosen_features(world[:, 1:], clouds.point_mass[:, 1:], objects[:, 1:], chosen),
        hand=_features(hand_world, hand_mass, hand.rest[..., None], hand_spin),
    )


def world_points(
    points: Float32[Array, "*#frame 3 point"], motion: RigidMotion[Array]
) -> Float32[Array, "*frame 3 point"]:
    """Points of the frames in the world frame; coordinates come before points, so that memory is read in order."""
    x, y, z = (points[..., axis, :] for axis in range(3))
    rows = [motion.rotation[..., axis, :, None] for axis in range(3)]
    rotated = [x * row[..., 0, :] + y * row[..., 1, :] + z * row[..., 2, :] for row in rows]
    return namespace(points).stack([rotated[axis] + motion.position[..., axis, None] for axis in range(3)], axis=-2)


def _nearest(
    clouds: SceneClouds[Array], world: Float32[Array, "slot object 3 512"], objects: RigidMotion[Array]
) -> Int[Array, "slot 512"]:
    xp = namespace(world)
    centroid = world_points(clouds.target_centroid, objects[:, 0])
    flat = _obstacle_by_obstacle(world[:, 1:])
    x, y, z = (flat[:, axis] - centroid[:, axis] for axis in range(3))
    order = xp.argsort(x * x + y * y + z * z, axis=1, stable=True)
    return xp.sort(order[:, :ENVIRONMENT_POINTS], axis=1)


def _obstacle_by_obstacle(world: Float32[Array, "slot obstacle 3 512"]) -> Float32[Array, "slot 3 point"]:
    xp = namespace(world)
    return xp.reshape(xp.permute_dims(world, (0, 2, 1, 3)), (world.shape[0], 3, world.shape[1] * world.shape[3]))


def _chosen_features(
    world: Float32[Array, "slot obstacle 3 512"],
    point_mass: Float32[Array, "slot obstacle"],
    motion: RigidMotion[Array],
    chosen: Int[Array, "slot 512"],
) -> Float32[Array, "slot 512 7"]:
    """Features of some of the obstacle points."""
    xp = namespace(world)
    body = chosen // world.shape[-1]

    def of_chosen(
        values: Float32[Array, "slot axis item"], at: Int[Array, "slot 512"]
    ) -> Float32[Array, "slot axis 512"]:
        shape = (world.shape[0], values.shape[1], ENVIRONMENT_POINTS)
        return xp.take_along_axis(values, xp.broadcast_to(at[:, None], shape), axis=2)

    mass = of_chosen(point_mass[:, None], body)[:, 0]
    rest, spin = (of_chosen(xp.matrix_transpose(each), body) for each in (motion.rest, motion.angular_velocity))
    return _features(of_chosen(_obstacle_by_obstacle(world), chosen), mass, rest, spin)


def _features(
    world: Float32[Array, "slot 3 point"],
    point_mass: Float32[Array, "slot #point"],
    rest: Float32[Array, "slot 3 #point"],
    spin: Float32[Array, "slot 3 #point"],
) -> Float32[Array, "slot point 7"]:
    """Features of points that move with ``rest + spin x world``."""
    xp = namespace(world)
    x, y, z = (world[:, axis] for axis in range(3))
    sx, sy, sz = (spin[:, axis] for axis in range(3))
    velocity = [sy * z - sz * y + rest[:, 0], sz * x - sx * z + rest[:, 1], sx * y - sy * x + rest[:, 2]]
    return xp.stack([x, y, z, xp.broadcast_to(point_mass, x.shape), *velocity], axis=-1)
