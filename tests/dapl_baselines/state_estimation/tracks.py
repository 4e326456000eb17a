"""Synthetic tracks of free bodies: poses and MuJoCo's velocities that fit each other, and what a tracker would see."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from clutter6d.geometry import quat_conjugate, quat_multiply
from clutter6d.seeding import generator
from dapl_baselines.state_estimation.rotation_vectors import quat_from_rotation_vector, rotation_vector_from_quat

FINE_S = 0.01


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Track:
    """``poses [time, body, 7]`` and ``velocities [time, body, 6]``, every ``dt_s`` seconds."""

    poses: np.ndarray
    velocities: np.ndarray
    dt_s: float


@cache
def integrate(velocity_of, duration_s: float, dt_s: float, bodies: int, seed: int = 0) -> Track:
    """A track whose velocities are ``velocity_of(time_s) [body, 6]``, integrated in steps of 10 ms."""
    rng = generator(seed, "track")
    quat = rng.normal(size=(bodies, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    position = rng.uniform(-0.3, 0.3, size=(bodies, 3))
    poses, velocities, every = [], [], round(dt_s / FINE_S)
    for step in range(round(duration_s / FINE_S) + 1):
        if step % every == 0:
            poses.append(np.concatenate([position, quat], axis=1))
            velocities.append(velocity_of(step * FINE_S))
        middle = velocity_of((step + 0.5) * FINE_S)
        position = position + FINE_S * middle[:, :3]
        quat = quat_multiply(quat, quat_from_rotation_vector(FINE_S * middle[:, 3:]))
        quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    return Track(poses=np.stack(poses), velocities=np.stack(velocities), dt_s=dt_s)


def see(poses: np.ndarray, sigma_m: float, sigma_rad: float, seed: int = 0) -> np.ndarray:
    """The poses as a tracker measures them: with noise, and quaternions of either sign."""
    rng = generator(seed, "measurement")
    turn = quat_from_rotation_vector(sigma_rad * rng.standard_normal((*poses.shape[:-1], 3)))
    quat = quat_multiply(poses[..., 3:], turn) * rng.choice([-1.0, 1.0], size=(*poses.shape[:-1], 1))
    return np.concatenate([poses[..., :3] + sigma_m * rng.standard_normal((*poses.shape[:-1], 3)), quat], axis=-1)


def differences(poses: np.ndarray, dt_s: float) -> np.ndarray:
    """Velocities from each pose and the one before; zero at first."""
    turn = quat_multiply(quat_conjugate(poses[:-1, ..., 3:]), poses[1:, ..., 3:])
    moved = np.concatenate([np.diff(poses[..., :3], axis=0), rotation_vector_from_quat(turn)], axis=-1) / dt_s
    return np.concatenate([np.zeros_like(moved[:1]), moved])


def rms(error: np.ndarray) -> tuple[float, float]:
    """Root mean square length of linear and angular errors ``[..., 6]``."""
    squared = error**2
    return tuple(float(np.sqrt(squared[..., part].sum(axis=-1).mean())) for part in (slice(3), slice(3, 6)))
