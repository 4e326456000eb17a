"""Point clouds in NumPy made for speed: written in place, chosen by partial sorting; a rival of the compiled ones."""

import numpy as np

from clutter6d.envs.point_cloud import HAND_POINT_MASS_KG, PointClouds, RigidMotion, SceneClouds

NEAREST = 512


def numpy_point_clouds(clouds: SceneClouds, objects: RigidMotion, hand: RigidMotion) -> PointClouds:
    """The point clouds of all slots, to the bit those of ``clutter6d.envs.point_cloud.point_clouds``."""
    slots = len(clouds.points)
    target, environment = (np.empty((slots, NEAREST, 7), dtype=np.float32) for _ in range(2))
    hands = np.empty((slots, clouds.hand_points.shape[-1], 7), dtype=np.float32)
    world = _place(clouds.points, objects)
    centroid = _place(clouds.target_centroid, objects[:, 0])[..., 0]
    rest, spin = objects.rest, objects.angular_velocity
    _fill(target, world[:, 0], clouds.point_mass[:, :1], rest[:, 0, :, None], spin[:, 0, :, None])
    nearest = _nearest(world[:, 1:], centroid)
    _fill(environment, *_gather(world, clouds.point_mass, rest, spin, nearest))
    hand_points = np.broadcast_to(clouds.hand_points, (slots, *clouds.hand_points.shape)).copy()
    _fill(hands, _place(hand_points, hand), HAND_POINT_MASS_KG, hand.rest[..., None], hand.angular_velocity[..., None])
    return PointClouds(target=target, environment=environment, hand=hands)


def _place(points: np.ndarray, motion: RigidMotion) -> np.ndarray:
    out, product = np.empty_like(points), np.empty_like(points[..., 0, :])
    x, y, z = (points[..., axis, :] for axis in range(3))
    for axis in range(3):
        row, placed = motion.rotation[..., axis, :, None], out[..., axis, :]
        np.multiply(x, row[..., 0, :], out=placed)
        placed += np.multiply(y, row[..., 1, :], out=product)
        placed += np.multiply(z, row[..., 2, :], out=product)
        placed += motion.position[..., axis, None]
    return out


def _nearest(obstacles: np.ndarray, centroid: np.ndarray) -> np.ndarray:
    """Flat indices of the nearest points, ascending; keys are the distances' bits above the indices, so none tie."""
    squared = np.zeros((obstacles.shape[0], obstacles.shape[1], obstacles.shape[3]), dtype=np.float32)
    for axis in range(3):
        offset = obstacles[:, :, axis] - centroid[:, axis, None, None]
        squared += np.multiply(offset, offset, out=offset)
    bits = squared.reshape(len(squared), -1).view(np.uint32)
    keys = bits.astype(np.uint64) << np.uint64(32) | np.arange(bits.shape[1], dtype=np.uint64)
    last = np.partition(keys, NEAREST - 1, axis=1)[:, NEAREST - 1]
    return np.nonzero(keys <= last[:, None])[1].reshape(-1, NEAREST)


def _gather(
    world: np.ndarray, point_mass: np.ndarray, rest: np.ndarray, spin: np.ndarray, chosen: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    slots, objects, _, points = world.shape
    body = chosen // points + (1 + objects * np.arange(slots)[:, None])
    axes = np.arange(3)[:, None]
    first, of_body = 3 * points * body + chosen % points, 3 * body[:, None] + axes
    return (
        world.ravel().take(first[:, None] + points * axes),
        point_mass.ravel().take(body),
        rest.ravel().take(of_body),
        spin.ravel().take(of_body),
    )


def _fill(
    out: np.ndarray, world: np.ndarray, point_mass: np.ndarray | float, rest: np.ndarray, spin: np.ndarray
) -> None:
    out[..., 3] = point_mass
    product, velocity = np.empty_like(world[..., 0, :]), np.empty_like(world[..., 0, :])
    for axis in range(3):
        second, third = (axis + 1) % 3, (axis + 2) % 3
        out[..., axis] = world[..., axis, :]
        np.multiply(spin[..., second, :], world[..., third, :], out=velocity)
        velocity -= np.multiply(spin[..., third, :], world[..., second, :], out=product)
        velocity += rest[..., axis, :]
        out[..., 4 + axis] = velocity
