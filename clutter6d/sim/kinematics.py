"""The arm's forward kinematics, Jacobian and inverse kinematics, for many configurations at once.

Everything works row by row: a row's result does not depend on how many rows there are. The hand's frame is the Franka
hand's: z along the fingers, y across them. Poses are hand frame to world frame. Arrays are NumPy's or torch's
(:mod:`clutter6d.arrays`); inverse kinematics is NumPy's alone.
"""

from dataclasses import dataclass
from typing import Generic

import numpy as np
from jaxtyping import Bool, Float, Int

from clutter6d.arrays import Array, constant, namespace
from clutter6d.geometry import cross, quat_conjugate, quat_from_matrix, quat_multiply, with_positive_scalar
from clutter6d.seeding import generator
from clutter6d.sim import robot_facts as facts

_MAX_STEP_RAD = 0.5
_POLISHED = 0.01
"""Error, in units of the tolerance, below which an attempt improves no further."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class HandKinematics(Generic[Array]):
    """Where the hand is and how it moves with the joints; to be computed once for a state.

    Attributes:
        pose: Pose of the hand's frame, with non-negative ``qw``.
        jacobian: Linear velocity [m/s] above angular velocity [rad/s] for each joint's velocity, world axes.
    """

    pose: Float[Array, "n 7"]
    jacobian: Float[Array, "n 6 7"]

    def __getitem__(self, rows: slice | Int[np.ndarray, "row"]) -> "HandKinematics[Array]":
        """The hands of some rows."""
        return HandKinematics(pose=self.pose[rows], jacobian=self.jacobian[rows])


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class _Frames(Generic[Array]):
    joint_origins: Float[Array, "n 7 3"]
    joint_axes: Float[Array, "n 7 3"]
    hand_position: Float[Array, "n 3"]
    hand_rotation: Float[Array, "n 3 3"]


def hand_kinematics(qpos: Float[Array, "n 7"]) -> HandKinematics[Array]:
    """Pose and Jacobian of the hand's frame from joint angles [rad]."""
    frames = _frames(qpos)
    return HandKinematics(pose=_pose(frames), jacobian=_jacobian(frames))


def hand_pose(qpos: Float[Array, "n 7"]) -> Float[Array, "n 7"]:
    """Pose of the hand's frame.

    Args:
        qpos: Joint angles [rad].

    Returns:
        Rows ``x y z qw qx qy qz`` with non-negative ``qw``.
    """
    return _pose(_frames(qpos))


def hand_jacobian(qpos: Float[Array, "n 7"]) -> Float[Array, "n 6 7"]:
    """Geometric Jacobian of the hand's frame: linear velocity [m/s] above angular velocity [rad/s], world axes."""
    return _jacobian(_frames(qpos))


def inverse_kinematics(
    targets: Float[np.ndarray, "n 7"],
    initial_qpos: Float[np.ndarray, "7"],
    *,
    seed: int = 0,
    restarts: int = 8,
    iterations: int = 60,
    position_tolerance_m: float = 1e-3,
    rotation_tolerance_rad: float = 1e-2,
) -> tuple[Float[np.ndarray, "n 7"], Bool[np.ndarray, "n"]]:
    """Joint angles that bring the hand to given poses, by damped least squares within the joint limits.

    The damping follows the error (Levenberg-Marquardt in the form of Sugihara, "Solvability-unconcerned inverse
    kinematics by the Levenberg-Marquardt method", T-RO 2011). The first attempt starts from ``initial_qpos``; rows
    that fail start again from random configurations.

    Args:
        targets: Hand poses ``x y z qw qx qy qz`` in the world frame.
        initial_qpos: Joint angles of the first attempt [rad].
        seed: Of the random restarts.
        restarts: Further attempts for rows that have not converged.
        iterations: Steps of each attempt.
        position_tolerance_m: Largest distance that counts as converged.
        rotation_tolerance_rad: Largest angle that counts as converged.

    Returns:
        The joint angles, within the limits, and which rows converged; the others hold their best attempt.
    """
    best = np.tile(initial_qpos, (len(targets), 1)).astype(np.float64)
    best_error = np.full(len(targets), np.inf)
    tolerance = (position_tolerance_m, rotation_tolerance_rad)
    for attempt in range(restarts + 1):
        open_rows = np.flatnonzero(best_error > 1)
        if not len(open_rows):
            break
        start = initial_qpos if attempt == 0 else _random_configuration(seed, attempt)
        qpos, error = _descend(targets[open_rows], start, iterations, tolerance)
        better = error < best_error[open_rows]
        best[open_rows[better]] = qpos[better]
        best_error[open_rows[better]] = error[better]
    return best, best_error <= 1


def _frames(qpos: Float[Array, "n 7"]) -> _Frames[Array]:
    """World frames of the joints and the hand, built column by column, from joint angles [rad]."""
    xp = namespace(qpos)
    ones = xp.ones_like(qpos[:, :1])
    x, y, z = (ones * constant(axis, qpos) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    position = ones * constant(facts.BASE_POSITION_M, qpos)
    origins, axes = [], []
    for i, (offset, twist) in enumerate(zip(facts.JOINT_OFFSETS_M, facts.JOINT_TWISTS, strict=True)):
        position = position + offset[0] * x + offset[1] * y + offset[2] * z
        y, z = {0: (y, z), 1: (z, -y), -1: (-z, y)}[twist]
        origins.append(position)
        axes.append(z)
        x, y = _turn(x, y, qpos[:, i : i + 1])
    position = position + facts.FLANGE_OFFSET_M[2] * z
    x, y = _turn(x, y, facts.HAND_YAW_RAD * ones)
    return _Frames(
        joint_origins=xp.stack(origins, axis=1),
        joint_axes=xp.stack(axes, axis=1),
        hand_position=position,
        hand_rotation=xp.stack([x, y, z], axis=-1),
    )


def _turn(
    x: Float[Array, "n 3"], y: Float[Array, "n 3"], angle: Float[Array, "n 1"]
) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
    xp = namespace(angle)
    cosine, sine = xp.cos(angle), xp.sin(angle)
    return cosine * x + sine * y, cosine * y - sine * x


def _pose(frames: _Frames[Array]) -> Float[Array, "n 7"]:
    xp = namespace(frames.hand_position)
    return xp.concat([frames.hand_position, quat_from_matrix(frames.hand_rotation)], axis=-1)


def _jacobian(frames: _Frames[Array]) -> Float[Array, "n 6 7"]:
    xp = namespace(frames.hand_position)
    linear = cross(frames.joint_axes, frames.hand_position[:, None] - frames.joint_origins)
    return xp.matrix_transpose(xp.concat([linear, frames.joint_axes], axis=-1))


def _error_twist(frames: _Frames[np.ndarray], targets: Float[np.ndarray, "n 7"]) -> Float[np.ndarray, "n 6"]:
    """Translation and rotation vector from the hand to its target, world axes."""
    turn = with_positive_scalar(quat_multiply(targets[:, 3:], quat_conjugate(quat_from_matrix(frames.hand_rotation))))
    sine = np.sqrt((turn[:, 1:] ** 2).sum(axis=-1, keepdims=True))
    angle = 2 * np.arctan2(sine, turn[:, :1])
    rotation = turn[:, 1:] * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)
    return np.concatenate([targets[:, :3] - frames.hand_position, rotation], axis=-1)


def _descend(
    targets: Float[np.ndarray, "n 7"], start: Float[np.ndarray, "7"], iterations: int, tolerance: tuple[float, float]
) -> tuple[Float[np.ndarray, "n 7"], Float[np.ndarray, "n"]]:
    """One attempt; returns the angles and the error in units of the tolerance."""
    qpos = np.tile(start, (len(targets), 1))
    for _ in range(iterations):
        frames = _frames(qpos)
        twist = _error_twist(frames, targets)
        is_open = _scaled_error(twist, tolerance) > _POLISHED
        if not is_open.any():
            break
        jacobian = _jacobian(frames)
        damping = 0.5 * (twist**2).sum(axis=-1) + 1e-6
        normal = np.einsum("nij,nik->njk", jacobian, jacobian) + damping[:, None, None] * np.eye(7)
        step = np.linalg.solve(normal, np.einsum("nij,ni->nj", jacobian, twist)[..., None])[..., 0]
        step = np.where(is_open[:, None], np.clip(step, -_MAX_STEP_RAD, _MAX_STEP_RAD), 0.0)
        qpos = np.clip(qpos + step, facts.JOINT_LOWER_RAD, facts.JOINT_UPPER_RAD)
    return qpos, _scaled_error(_error_twist(_frames(qpos), targets), tolerance)


def _scaled_error(twist: Float[np.ndarray, "n 6"], tolerance: tuple[float, float]) -> Float[np.ndarray, "n"]:
    position = np.sqrt((twist[:, :3] ** 2).sum(axis=-1)) / tolerance[0]
    return np.maximum(position, np.sqrt((twist[:, 3:] ** 2).sum(axis=-1)) / tolerance[1])


def _random_configuration(seed: int, attempt: int) -> Float[np.ndarray, "7"]:
    margin = 0.1 * (facts.JOINT_UPPER_RAD - facts.JOINT_LOWER_RAD)
    draws = generator(seed, "inverse_kinematics", attempt)
    return draws.uniform(facts.JOINT_LOWER_RAD + margin, facts.JOINT_UPPER_RAD - margin)
