"""Rotation vectors: the tangent space of rotations, in which errors and their covariances live.

A vector's direction is the axis, its length the angle [rad]. Formulas as in Solà, Deray and Atchuthan, "A micro Lie
theory for state estimation in robotics" (2018), section "3D rotations"; all of them are for errors on the right, which
are vectors in the object's own frame.
"""

import numpy as np
from jaxtyping import Float64

from clutter6d.geometry import cross, with_positive_scalar

_SMALL_RAD = 1e-4
"""Below this angle the first terms of a series are exact to the last bits, and nothing is divided by zero."""


def quat_from_rotation_vector(vector: Float64[np.ndarray, "*row 3"]) -> Float64[np.ndarray, "*row 4"]:
    """The unit quaternion of a rotation vector (the exponential map)."""
    half = _length(vector) / 2
    return np.concatenate([np.cos(half), np.sinc(half / np.pi) / 2 * vector], axis=-1)


def rotation_vector_from_quat(quat: Float64[np.ndarray, "*row 4"]) -> Float64[np.ndarray, "*row 3"]:
    """The rotation vector of a unit quaternion, no longer than pi (the logarithm); ``q`` and ``-q`` give the same."""
    quat = with_positive_scalar(quat)
    scalar, axis = quat[..., :1], quat[..., 1:]
    sine = _length(axis)
    is_small = sine < _SMALL_RAD
    ratio = 2 * np.arctan2(sine, scalar) / np.where(is_small, 1.0, sine)
    return np.where(is_small, 2.0, ratio) * axis


def right_jacobian(vector: Float64[np.ndarray, "*row 3"]) -> Float64[np.ndarray, "*row 3 3"]:
    """How the rotation of ``vector + d`` differs from that of ``vector``: by ``J d`` on the right, for small ``d``."""
    angle = _length(vector)[..., None]
    is_small = angle < _SMALL_RAD
    safe = np.where(is_small, 1.0, angle)
    first = np.where(is_small, 0.5, (1 - np.cos(safe)) / safe**2)
    second = np.where(is_small, 1 / 6, (safe - np.sin(safe)) / safe**3)
    skew = cross_matrix(vector)
    return np.eye(3) - first * skew + second * (skew @ skew)


def cross_matrix(vector: Float64[np.ndarray, "*row 3"]) -> Float64[np.ndarray, "*row 3 3"]:
    """The matrix that takes the vector product with ``vector``."""
    columns = [cross(vector, np.broadcast_to(axis, vector.shape)) for axis in np.eye(3)]
    return np.stack(columns, axis=-1)


def _length(vector: Float64[np.ndarray, "*row axis"]) -> Float64[np.ndarray, "*row 1"]:
    return np.sqrt((vector * vector).sum(axis=-1, keepdims=True))
