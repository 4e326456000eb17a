"""Point features of all objects of all slots in one go: position, share of mass, velocity.

A point of a rigid body at ``p`` in the object frame is at ``R p + t`` and moves with ``R (w x p) + v``, where MuJoCo
keeps ``w`` in the object frame and ``v`` in the world frame. Every product is written out term by term in float32, so
that a slot's points are the same to the bit in any batch.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64, Int, UInt64

from clutter6d.geometry import quat_to_matrix, rotate
from clutter6d.sim.scene_model import SceneModel

POINT_FEATURES = 7
Rows = slice | Int[np.ndarray, "row"]
"""Some of the slots."""
ENVIRONMENT_POINTS = 512


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class RigidMotion:
    """Rotation, position and velocity of rigid frames, to the world frame.

    Attributes:
        rotation: Rotation matrices.
        position: Positions of the frames' origins [m].
        linear_velocity: Velocities of the origins [m/s].
        angular_velocity: Angular velocities in the world frame [rad/s].
    """

    rotation: Float32[np.ndarray, "*frame 3 3"]
    position: Float32[np.ndarray, "*frame 3"]
    linear_velocity: Float32[np.ndarray, "*frame 3"]
    angular_velocity: Float32[np.ndarray, "*frame 3"]

    def __getitem__(self, key: tuple[slice, int]) -> "RigidMotion":
        """The motion of some of the frames."""
        return RigidMotion(
            rotation=self.rotation[key],
            position=self.position[key],
            linear_velocity=self.linear_velocity[key],
            angular_velocity=self.angular_velocity[key],
        )


def free_body_motion(
    poses: Float64[np.ndarray, "*frame 7"], velocities: Float64[np.ndarray, "*frame 6"]
) -> RigidMotion:
    """Motion of free bodies from their poses and MuJoCo's velocities (linear: world frame, angular: body frame)."""
    return RigidMotion(
        rotation=quat_to_matrix(poses[..., 3:]).astype(np.float32),
        position=poses[..., :3].astype(np.float32),
        linear_velocity=velocities[..., :3].astype(np.float32),
        angular_velocity=rotate(poses[..., 3:], velocities[..., 3:]).astype(np.float32),
    )


def world_points(
    points: Float32[np.ndarray, "*frame 3 point"], motion: RigidMotion
) -> Float32[np.ndarray, "*frame 3 point"]:
    """Points of the frames in the world frame; coordinates come before points, so that memory is read in order."""
    out = np.empty_like(points)
    product = np.empty_like(points[..., 0, :])
    x, y, z = (points[..., axis, :] for axis in range(3))
    for axis in range(3):
        row, target = motion.rotation[..., axis, :, None], out[..., axis, :]
        np.multiply(x, row[..., 0, :], out=target)
        target += np.multiply(y, row[..., 1, :], out=product)
        target += np.multiply(z, row[..., 2, :], out=product)
        target += motion.position[..., axis, None]
    return out


def write_features(
    out: Float32[np.ndarray, "*frame point 7"],
    world: Float32[np.ndarray, "*frame 3 point"],
    point_mass: Float32[np.ndarray, "*#frame #point"],
    motion: RigidMotion,
) -> None:
    """Fill ``x y z``, mass share and velocity of points given in the world frame; all of a frame move with it."""
    rest, spin = _velocity_field(motion)
    _fill(out, world, point_mass, rest[..., None], spin[..., None])


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SceneClouds:
    """What the point clouds of slots are made from; constant while a slot keeps its scene.

    Attributes:
        points: Canonical surface points in the object frames, coordinates before points.
        point_mass: Each object's mass over its number of points [kg].
        target_centroid: Centroid of the target's points in its frame, as one column.
    """

    points: Float32[np.ndarray, "slot object 3 512"]
    point_mass: Float32[np.ndarray, "slot object"]
    target_centroid: Float32[np.ndarray, "slot 3 1"]

    @classmethod
    def allocate(cls, slots: int, objects: int) -> "SceneClouds":
        """Clouds of slots without a scene yet."""
        return cls(
            points=np.zeros((slots, objects, 3, 512), dtype=np.float32),
            point_mass=np.zeros((slots, objects), dtype=np.float32),
            target_centroid=np.zeros((slots, 3, 1), dtype=np.float32),
        )

    def load(self, slot: int, scene: SceneModel) -> None:
        """Take over a scene's points and masses."""
        for index, asset in enumerate(scene.assets):
            self.points[slot, index] = asset.surface_points.T
        self.point_mass[slot] = scene.object_masses_kg() / self.points.shape[-1]
        self.target_centroid[slot, :, 0] = scene.assets[0].surface_points.mean(axis=0, dtype=np.float64)

    def __getitem__(self, rows: Rows) -> "SceneClouds":
        """The clouds of some slots."""
        return SceneClouds(
            points=self.points[rows], point_mass=self.point_mass[rows], target_centroid=self.target_centroid[rows]
        )


def object_features(
    clouds: SceneClouds,
    motion: RigidMotion,
    out_object: Float32[np.ndarray, "slot 512 7"],
    out_environment: Float32[np.ndarray, "slot 512 7"],
) -> None:
    """Fill the target's points, and the obstacle points nearest to the target's centroid.

    Args:
        clouds: Canonical points; the target is each slot's first object.
        motion: Of all objects, with axes ``slot object``.
        out_object: Receives the target's point features.
        out_environment: Receives those of the nearest obstacle points, in the order of the obstacles and their points.
    """
    world = world_points(clouds.points, motion)
    rest, spin = _velocity_field(motion)
    _fill(out_object, world[:, 0], clouds.point_mass[:, :1], rest[:, 0, :, None], spin[:, 0, :, None])
    nearest = _nearest(world[:, 1:], world_points(clouds.target_centroid, motion[:, 0])[..., 0])
    _fill(out_environment, *_gather(world, clouds.point_mass, rest, spin, nearest))


def _gather(
    world: Float32[np.ndarray, "slot object 3 512"],
    point_mass: Float32[np.ndarray, "slot object"],
    rest: Float32[np.ndarray, "slot object 3"],
    spin: Float32[np.ndarray, "slot object 3"],
    chosen: Int[np.ndarray, "slot 512"],
) -> tuple[
    Float32[np.ndarray, "slot 3 512"],
    Float32[np.ndarray, "slot 512"],
    Float32[np.ndarray, "slot 3 512"],
    Float32[np.ndarray, "slot 3 512"],
]:
    """Position, mass share, ``rest`` and ``spin`` of chosen obstacle points, by flat indices."""
    slots, objects, _, points = world.shape
    body = chosen // points + (1 + objects * np.arange(slots)[:, None])
    axes = np.arange(3)[:, None]
    first = 3 * points * body + chosen % points
    of_body = 3 * body[:, None] + axes
    return (
        world.ravel().take(first[:, None] + points * axes),
        point_mass.ravel().take(body),
        rest.ravel().take(of_body),
        spin.ravel().take(of_body),
    )


def _nearest(
    obstacles: Float32[np.ndarray, "slot obstacle 3 512"], centroid: Float32[np.ndarray, "slot 3"]
) -> Int[np.ndarray, "slot 512"]:
    """Flat indices of the obstacle points nearest to the target's centroid, ascending.

    A point's key is its squared distance's bits above its index: no two keys are equal, so which points are the
    nearest never depends on how the partition treats ties.
    """
    squared = np.zeros((obstacles.shape[0], obstacles.shape[1], obstacles.shape[3]), dtype=np.float32)
    for axis in range(3):
        offset = obstacles[:, :, axis] - centroid[:, axis, None, None]
        squared += np.multiply(offset, offset, out=offset)
    keys = _keys(squared.reshape(len(squared), -1))
    last = np.partition(keys, ENVIRONMENT_POINTS - 1, axis=1)[:, ENVIRONMENT_POINTS - 1]
    return np.nonzero(keys <= last[:, None])[1].reshape(-1, ENVIRONMENT_POINTS)


def _keys(squared: Float32[np.ndarray, "slot point"]) -> UInt64[np.ndarray, "slot point"]:
    """Floats that are not negative sort as their bits do."""
    return squared.view(np.uint32).astype(np.uint64) << np.uint64(32) | np.arange(squared.shape[1], dtype=np.uint64)


def _fill(
    out: Float32[np.ndarray, "*frame point 7"],
    world: Float32[np.ndarray, "*frame 3 point"],
    point_mass: Float32[np.ndarray, "*#frame #point"],
    rest: Float32[np.ndarray, "*#frame 3 #point"],
    spin: Float32[np.ndarray, "*#frame 3 #point"],
) -> None:
    """Features of points that move with ``rest + spin x world``."""
    out[..., 3] = point_mass
    product = np.empty_like(world[..., 0, :])
    velocity = np.empty_like(product)
    for axis in range(3):
        second, third = (axis + 1) % 3, (axis + 2) % 3
        out[..., axis] = world[..., axis, :]
        np.multiply(spin[..., second, :], world[..., third, :], out=velocity)
        velocity -= np.multiply(spin[..., third, :], world[..., second, :], out=product)
        velocity += rest[..., axis, :]
        out[..., 4 + axis] = velocity


def _velocity_field(
    motion: RigidMotion,
) -> tuple[Float32[np.ndarray, "*frame 3"], Float32[np.ndarray, "*frame 3"]]:
    """``rest`` and ``spin``: a point at ``p`` in the world moves with ``rest + spin x p``."""
    return motion.linear_velocity - np.cross(motion.angular_velocity, motion.position), motion.angular_velocity
