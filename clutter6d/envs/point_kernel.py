"""The point clouds of :mod:`clutter6d.envs.point_cloud` on the CPU, compiled: the same bits in a fraction of the time.

One slot after the other, so that its points stay in the processor's cache; every product and sum in the order of the
readable form, and no fast mathematics. The nearest points are found without sorting: floats that are not negative are
ordered as their bits are, so 32 counts find the bits of the 512th distance one by one.
"""

from collections.abc import Callable
from typing import Any, no_type_check

import numba
import numpy as np
from jaxtyping import Int64

from clutter6d.envs.point_cloud import (
    ENVIRONMENT_POINTS,
    HAND_POINT_MASS_KG,
    POINT_FEATURES,
    PointClouds,
    RigidMotion,
    SceneClouds,
)

EachPart = Callable[[int, Callable[[slice], None]], None]
"""Calls a function with slices that together are so many rows."""


def _at_once(rows: int, fill: Callable[[slice], None]) -> None:
    fill(slice(0, rows))


def compiled_point_clouds(
    clouds: SceneClouds[np.ndarray],
    objects: RigidMotion[np.ndarray],
    hand: RigidMotion[np.ndarray],
    each_part: EachPart = _at_once,
) -> PointClouds[np.ndarray]:
    """The point clouds of all slots, to the bit those of :func:`clutter6d.envs.point_cloud.point_clouds`.

    Args:
        clouds: Canonical points; the target is each slot's first object.
        objects: Motion of all objects, with axes ``slot object``.
        hand: Motion of the hands, with axis ``slot``.
        each_part: May fill parts of the slots side by side: compiled code does not hold the interpreter's lock.
    """
    slots, points, hand_points = len(clouds.points), clouds.points.shape[-1], clouds.hand_points.shape[-1]
    sizes = points, ENVIRONMENT_POINTS, hand_points
    out = [np.empty((slots, size, POINT_FEATURES), dtype=np.float32) for size in sizes]
    sources = clouds.points, clouds.point_mass, clouds.target_centroid
    hand_sources = clouds.hand_points, np.float32(HAND_POINT_MASS_KG)
    known = *sources, *_field(objects), *hand_sources, *_field(hand), *out
    each_part(slots, lambda part: _fill_slots(part.start, part.stop, *known))
    return PointClouds(target=out[0], environment=out[1], hand=out[2])


def compiled_nearest_points(
    clouds: SceneClouds[np.ndarray], objects: RigidMotion[np.ndarray]
) -> Int64[np.ndarray, "slot 512"]:
    """Which obstacle points are the environment's, as :func:`clutter6d.envs.point_cloud.nearest_points`."""
    chosen = np.empty((len(clouds.points), ENVIRONMENT_POINTS), dtype=np.int64)
    _choose(clouds.points, clouds.target_centroid, *_field(objects)[:2], chosen)
    return chosen


def _field(motion: RigidMotion[np.ndarray]) -> list[np.ndarray]:
    parts = motion.rotation, motion.position, motion.rest, motion.angular_velocity
    return [np.ascontiguousarray(part) for part in parts]


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile at the first call; the code is kept for other processes, beside this file or in the user's cache.

    All that the code depends on must be in this file: numba does not see when a constant of another one changes.
    """
    try:
        return numba.njit(nogil=True, cache=True)(function)
    except RuntimeError:  # neither place can be written to: every process compiles for itself
        return numba.njit(nogil=True)(function)


@compiled
@no_type_check  # the compiler is the checker
def _fill_slots(
    first: int,
    last: int,
    points: np.ndarray,
    point_mass: np.ndarray,
    target_centroid: np.ndarray,
    rotation: np.ndarray,
    position: np.ndarray,
    rest: np.ndarray,
    spin: np.ndarray,
    hand_points: np.ndarray,
    hand_mass: np.float32,
    hand_rotation: np.ndarray,
    hand_position: np.ndarray,
    hand_rest: np.ndarray,
    hand_spin: np.ndarray,
    out_target: np.ndarray,
    out_environment: np.ndarray,
    out_hand: np.ndarray,
) -> None:
    _, objects, _, size = points.shape
    world = np.empty((objects, 3, size), dtype=np.float32)
    squared = np.empty((objects - 1) * size, dtype=np.float32)
    chosen = np.empty(out_environment.shape[1], dtype=np.int64)
    hand_world = np.empty(hand_points.shape, dtype=np.float32)
    centroid = np.empty((3, 1), dtype=np.float32)
    for slot in range(first, last):
        for body in range(objects):
            _place(points[slot, body], rotation[slot, body], position[slot, body], world[body])
        _place(target_centroid[slot], rotation[slot, 0], position[slot, 0], centroid)
        _place(hand_points, hand_rotation[slot], hand_position[slot], hand_world)
        for body in range(1, objects):
            _square_distances(world[body], centroid, squared[(body - 1) * size : body * size])
        for point in range(size):
            _write(out_target[slot, point], world[0], point, point_mass[slot, 0], rest[slot, 0], spin[slot, 0])
        for point in range(hand_points.shape[1]):
            _write(out_hand[slot, point], hand_world, point, hand_mass, hand_rest[slot], hand_spin[slot])
        _take_nearest(squared, chosen)
        for row in range(len(chosen)):
            body, point = 1 + chosen[row] // size, chosen[row] % size
            mass = point_mass[slot, body]
            _write(out_environment[slot, row], world[body], point, mass, rest[slot, body], spin[slot, body])


@compiled
@no_type_check  # the compiler is the checker
def _choose(
    points: np.ndarray, target_centroid: np.ndarray, rotation: np.ndarray, position: np.ndarray, out: np.ndarray
) -> None:
    slots, objects, _, size = points.shape
    world = np.empty((3, size), dtype=np.float32)
    squared = np.empty((objects - 1) * size, dtype=np.float32)
    centroid = np.empty((3, 1), dtype=np.float32)
    for slot in range(slots):
        _place(target_centroid[slot], rotation[slot, 0], position[slot, 0], centroid)
        for body in range(1, objects):
            _place(points[slot, body], rotation[slot, body], position[slot, body], world)
            _square_distances(world, centroid, squared[(body - 1) * size : body * size])
        _take_nearest(squared, out[slot])


@compiled
@no_type_check  # the compiler is the checker
def _take_nearest(squared: np.ndarray, out: np.ndarray) -> None:
    """Indices of the smallest values, ascending; of equal ones, the first."""
    bits = squared.view(np.uint32)
    limit = _bits_of_nearest(bits, len(out))
    equal = len(out) - _count_below(bits, limit)
    row = 0
    for index in range(len(bits)):
        if bits[index] > limit or (bits[index] == limit and equal == 0):
            continue
        equal -= bits[index] == limit
        out[row] = index
        row += 1


@compiled
@no_type_check  # the compiler is the checker
def _place(points: np.ndarray, rotation: np.ndarray, position: np.ndarray, out: np.ndarray) -> None:
    """Points in the world frame."""
    for axis in range(3):
        a, b, c, offset = rotation[axis, 0], rotation[axis, 1], rotation[axis, 2], position[axis]
        for point in range(points.shape[1]):
            out[axis, point] = points[0, point] * a + points[1, point] * b + points[2, point] * c + offset


@compiled
@no_type_check  # the compiler is the checker
def _square_distances(world: np.ndarray, centroid: np.ndarray, out: np.ndarray) -> None:
    cx, cy, cz = centroid[0, 0], centroid[1, 0], centroid[2, 0]
    for point in range(len(out)):
        x, y, z = world[0, point] - cx, world[1, point] - cy, world[2, point] - cz
        out[point] = x * x + y * y + z * z


@compiled
@no_type_check  # the compiler is the checker
def _bits_of_nearest(bits: np.ndarray, count: int) -> int:
    """The smallest value that at least ``count`` of the values do not exceed, or the largest possible one."""
    low, high = 0, 0xFFFFFFFF
    while low < high:
        middle = (low + high) // 2
        if _count_below(bits, middle + 1) >= count:
            high = middle
        else:
            low = middle + 1
    return low


@compiled
@no_type_check  # the compiler is the checker
def _count_below(bits: np.ndarray, limit: int) -> int:
    count = 0
    for index in range(len(bits)):
        count += bits[index] < limit
    return count


@compiled
@no_type_check  # the compiler is the checker
def _write(
    out: np.ndarray, world: np.ndarray, point: int, mass: np.float32, rest: np.ndarray, spin: np.ndarray
) -> None:
    """Features of a point that moves with ``rest + spin x world``."""
    x, y, z = world[0, point], world[1, point], world[2, point]
    out[0], out[1], out[2], out[3] = x, y, z, mass
    out[4] = spin[1] * z - spin[2] * y + rest[0]
    out[5] = spin[2] * x - spin[0] * z + rest[1]
    out[6] = spin[0] * y - spin[1] * x + rest[2]
