"""Poses and rotations as batched array functions.

Quaternions are ``wxyz`` and unit; a pose row is ``x y z qw qx qy qz``; lengths in metres, angles in radians. All
functions broadcast over leading axes and work element by element, so a row's result does not depend on the batch.
They take and give NumPy's or torch's arrays (:mod:`clutter6d.arrays`); rotations are made from angles in NumPy only.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from clutter6d.arrays import Array, namespace

IDENTITY_QUAT = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class Pose:
    """A rigid pose, object frame to world frame: position in metres and unit quaternion ``wxyz``."""

    position: tuple[float, float, float]
    quat_wxyz: tuple[float, float, float, float]

    def as_row(self) -> Float[np.ndarray, "7"]:
        """The pose as ``x y z qw qx qy qz``."""
        return np.array([*self.position, *self.quat_wxyz])

    @classmethod
    def from_row(cls, row: Float[np.ndarray, "7"]) -> "Pose":
        """The pose of a row ``x y z qw qx qy qz``, exactly."""
        x, y, z, qw, qx, qy, qz = (float(value) for value in row)
        return cls(position=(x, y, z), quat_wxyz=(qw, qx, qy, qz))


def quat_multiply(a: Float[Array, "*#n 4"], b: Float[Array, "*#n 4"]) -> Float[Array, "*n 4"]:
    """Hamilton product: rotate by ``b``, then by ``a``."""
    aw, ax, ay, az = (a[..., i] for i in range(4))
    bw, bx, by, bz = (b[..., i] for i in range(4))
    return namespace(a).stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def quat_conjugate(quat: Float[Array, "*n 4"]) -> Float[Array, "*n 4"]:
    """The inverse rotation."""
    return namespace(quat).concat([quat[..., :1], -quat[..., 1:]], axis=-1)


def quat_normalize(quat: Float[Array, "*n 4"]) -> Float[Array, "*n 4"]:
    """The unit quaternion of the same direction."""
    xp = namespace(quat)
    return quat / xp.sqrt(xp.sum(quat * quat, axis=-1, keepdims=True))


def quat_from_axis_angle(
    axis: Float[np.ndarray, "*#n 3"], angle: Float[np.ndarray, "*#n"] | float
) -> Float[np.ndarray, "*n 4"]:
    """Rotation by ``angle`` about a unit ``axis``."""
    half = np.asarray(angle)[..., None] / 2
    vector = np.sin(half) * axis
    scalar = np.broadcast_to(np.cos(half), (*vector.shape[:-1], 1))
    return np.concatenate([scalar, vector], axis=-1)


def quat_from_yaw(yaw: Float[np.ndarray, "*n"] | float) -> Float[np.ndarray, "*n 4"]:
    """Rotation about the vertical axis."""
    half = np.asarray(yaw, dtype=float) / 2
    zero = np.zeros_like(half)
    return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)


def quat_to_matrix(quat: Float[Array, "*n 4"]) -> Float[Array, "*n 3 3"]:
    """The rotation matrix of a unit quaternion."""
    xp = namespace(quat)
    w, x, y, z = (quat[..., i] for i in range(4))
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return xp.stack([xp.stack(row, axis=-1) for row in rows], axis=-2)


def quat_from_matrix(matrix: Float[Array, "*n 3 3"]) -> Float[Array, "*n 4"]:
    """The unit quaternion of a rotation matrix, with non-negative scalar part.

    Of the four rows of the quaternion's outer product with itself, the longest is used, so nothing cancels.
    """
    xp, m = namespace(matrix), matrix
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    wx, wy, wz = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    xy, xz, yz = m[..., 1, 0] + m[..., 0, 1], m[..., 0, 2] + m[..., 2, 0], m[..., 2, 1] + m[..., 1, 2]
    rows = [
        [1 + xx + yy + zz, wx, wy, wz],
        [wx, 1 + xx - yy - zz, xy, xz],
        [wy, xy, 1 - xx + yy - zz, yz],
        [wz, xz, yz, 1 - xx - yy + zz],
    ]
    outer = xp.stack([xp.stack(row, axis=-1) for row in rows], axis=-2)
    best = xp.argmax(xp.linalg.diagonal(outer), axis=-1)
    chosen = xp.broadcast_to(best[..., None, None], (*matrix.shape[:-2], 1, 4))
    return with_positive_scalar(quat_normalize(xp.take_along_axis(outer, chosen, axis=-2)[..., 0, :]))


def with_positive_scalar(quat: Float[Array, "*n 4"]) -> Float[Array, "*n 4"]:
    """The same rotation with a scalar part that is not negative."""
    return namespace(quat).where(quat[..., :1] < 0, -quat, quat)


def cross(a: Float[Array, "*#n 3"], b: Float[Array, "*#n 3"]) -> Float[Array, "*n 3"]:
    """Vector product."""
    ax, ay, az = (a[..., i] for i in range(3))
    bx, by, bz = (b[..., i] for i in range(3))
    return namespace(a).stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def rotate(quat: Float[Array, "*#n 4"], vectors: Float[Array, "*#n 3"]) -> Float[Array, "*n 3"]:
    """Rotate vectors by unit quaternions."""
    scalar, axis = quat[..., :1], quat[..., 1:]
    twice_cross = 2 * cross(axis, vectors)
    return vectors + scalar * twice_cross + cross(axis, twice_cross)


def transform_points(pose: Float[Array, "*n 7"], points: Float[Array, "*#n point 3"]) -> Float[Array, "*n point 3"]:
    """Points of the object frame in the world frame."""
    return rotate(pose[..., None, 3:], points) + pose[..., None, :3]


def rotation_error_rad(a: Float[Array, "*#n 4"], b: Float[Array, "*#n 4"]) -> Float[Array, "*n"]:
    """Angle between two rotations, ``2 acos|a . b|`` in [0, pi] (paper, "Reward Function")."""
    xp = namespace(a)
    return xp.asarray(2 * xp.acos(xp.minimum(xp.abs(xp.sum(a * b, axis=-1)), 1.0)))


def rotation_6d(quat: Float[Array, "*n 4"]) -> Float[Array, "*n 6"]:
    """The first two columns of the rotation matrix, one after the other."""
    matrix = quat_to_matrix(quat)
    return namespace(quat).concat([matrix[..., :, 0], matrix[..., :, 1]], axis=-1)


def motion_between(start: Float[Array, "*#n 7"], end: Float[Array, "*#n 7"]) -> Float[Array, "*n 7"]:
    """How a body moves from one pose to another, in world axes: its origin's displacement, and the turn about it."""
    turn = quat_multiply(end[..., 3:], quat_conjugate(start[..., 3:]))
    return namespace(end).concat([end[..., :3] - start[..., :3], turn], axis=-1)


def is_unit(quat: Float[Array, "*n 4"], tolerance: float = 1e-6) -> Bool[Array, "*n"]:
    """Whether quaternions have unit length."""
    xp = namespace(quat)
    return xp.asarray(xp.abs(xp.sum(quat * quat, axis=-1) - 1) < tolerance)
