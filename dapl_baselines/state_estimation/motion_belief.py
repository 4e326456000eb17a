"""What is believed of the motion of rigid bodies, and the two steps of an extended Kalman filter on SE(3).

The mean of a belief is a pose (position and unit quaternion) and MuJoCo's velocity (linear: world frame, angular: body
frame). Its covariance is that of an error of twelve numbers: position, rotation vector in the body frame, linear and
angular velocity. The error is put into the mean after each correction, so the quaternion stays a unit quaternion and
the covariance has no direction without meaning (an *error-state* filter).

Between two looks a body keeps its velocity, which white noise of acceleration disturbs. A constant angular velocity is
the same in the body frame and in the world frame, so the choice of the frame is no other model.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64

from clutter6d.geometry import quat_conjugate, quat_multiply, quat_normalize, quat_to_matrix
from dapl_baselines.state_estimation.rotation_vectors import (
    quat_from_rotation_vector,
    right_jacobian,
    rotation_vector_from_quat,
)

Poses = Float64[np.ndarray, "*row 7"]
Errors = Float64[np.ndarray, "*row 6"]
"""Of poses: position [m], then rotation vector in the body frame [rad]."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class MotionBelief:
    """Poses and velocities of bodies, and how uncertain they are.

    Attributes:
        poses: Body frame to world frame.
        velocities: Linear in the world frame [m/s], angular in the body frame [rad/s].
        covariance: Of position, rotation, linear and angular velocity.
    """

    poses: Float64[np.ndarray, "*row 7"]
    velocities: Float64[np.ndarray, "*row 6"]
    covariance: Float64[np.ndarray, "*row 12 12"]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Innovation:
    """What a measurement says that was not predicted.

    Attributes:
        error: Measured pose relative to the predicted one.
        covariance: How large it was expected to be.
    """

    error: Float64[np.ndarray, "*row 6"]
    covariance: Float64[np.ndarray, "*row 6 6"]

    def squared(self) -> Float64[np.ndarray, "*row"]:
        """The normalised innovation squared: chi-square with six degrees of freedom if all assumptions hold."""
        weighted = np.linalg.solve(self.covariance, self.error[..., None])[..., 0]
        return (self.error * weighted).sum(axis=-1)


def at_rest(
    poses: Poses, pose_variance: Float64[np.ndarray, "6"], velocity_variance: Float64[np.ndarray, "6"]
) -> MotionBelief:
    """The belief of bodies that were seen for the first time: where they were seen, at rest as far as is known."""
    rows, variance = poses.shape[:-1], np.concatenate([pose_variance, velocity_variance])
    covariance = np.broadcast_to(np.diag(variance), (*rows, 12, 12))
    return MotionBelief(poses=poses, velocities=np.zeros((*rows, 6)), covariance=covariance)


def predict(belief: MotionBelief, dt_s: float) -> MotionBelief:
    """The belief after a time in which every body kept its velocity; :func:`accelerate` adds the doubt."""
    turn = dt_s * belief.velocities[..., 3:]
    position = belief.poses[..., :3] + dt_s * belief.velocities[..., :3]
    quat = quat_normalize(quat_multiply(belief.poses[..., 3:], quat_from_rotation_vector(turn)))
    step = np.broadcast_to(np.eye(12), belief.covariance.shape).copy()
    step[..., :3, 6:9] = dt_s * np.eye(3)
    step[..., 3:6, 3:6] = quat_to_matrix(quat_from_rotation_vector(-turn))
    step[..., 3:6, 9:] = dt_s * right_jacobian(turn)
    covariance = step @ belief.covariance @ np.swapaxes(step, -1, -2)
    return replace(belief, poses=np.concatenate([position, quat], axis=-1), covariance=covariance)


def accelerate(belief: MotionBelief, dt_s: float, density: Float64[np.ndarray, "6"]) -> MotionBelief:
    """The belief with the doubt that unknown accelerations add in a time.

    Args:
        belief: What is believed of the bodies.
        dt_s: The time [s].
        density: Spectral density of each acceleration [m²/s³, rad²/s³]: variance that a velocity gains in a second.
    """
    growth = np.array([[dt_s**3 / 3, dt_s**2 / 2], [dt_s**2 / 2, dt_s]])
    return replace(belief, covariance=belief.covariance + np.kron(growth, np.diag(density)))


def innovate(belief: MotionBelief, measured: Poses, pose_variance: Float64[np.ndarray, "6"]) -> Innovation:
    """Compare measured poses with a prediction."""
    turn = quat_multiply(quat_conjugate(belief.poses[..., 3:]), measured[..., 3:])
    error = [measured[..., :3] - belief.poses[..., :3], rotation_vector_from_quat(turn)]
    return Innovation(
        error=np.concatenate(error, axis=-1), covariance=belief.covariance[..., :6, :6] + np.diag(pose_variance)
    )


def correct(belief: MotionBelief, innovation: Innovation, pose_variance: Float64[np.ndarray, "6"]) -> MotionBelief:
    """The belief after a measurement; the covariance by Joseph's form, which stays symmetric and positive.

    The error is small against a radian, so the covariance is not turned along with the mean.
    """
    before = belief.covariance
    gain = np.swapaxes(np.linalg.solve(innovation.covariance, before[..., :6, :]), -1, -2)
    shift = (gain @ innovation.error[..., None])[..., 0]
    kept = np.broadcast_to(np.eye(12), before.shape).copy()
    kept[..., :6] -= gain
    covariance = kept @ before @ np.swapaxes(kept, -1, -2) + (gain * pose_variance) @ np.swapaxes(gain, -1, -2)
    position = belief.poses[..., :3] + shift[..., :3]
    quat = quat_normalize(quat_multiply(belief.poses[..., 3:], quat_from_rotation_vector(shift[..., 3:6])))
    return MotionBelief(
        poses=np.concatenate([position, quat], axis=-1),
        velocities=belief.velocities + shift[..., 6:],
        covariance=covariance,
    )


def choose(is_first: Bool[np.ndarray, "*row"], first: MotionBelief, second: MotionBelief) -> MotionBelief:
    """Of each body one of two beliefs."""
    return MotionBelief(
        poses=np.where(is_first[..., None], first.poses, second.poses),
        velocities=np.where(is_first[..., None], first.velocities, second.velocities),
        covariance=np.where(is_first[..., None, None], first.covariance, second.covariance),
    )
