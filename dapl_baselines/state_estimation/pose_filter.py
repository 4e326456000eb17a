"""Velocities from a stream of noisy poses (paper, "Dynamics Distillation and Estimation", "EKF-Refined Velocity").

The steps of the filter are those of :mod:`dapl_baselines.state_estimation.motion_belief`; here stands what becomes of
measurements that are missing, or that are of something else. All bodies are filtered at once.
"""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float64

from clutter6d.errors import InvalidValueError
from clutter6d.geometry import IDENTITY_QUAT, quat_normalize
from dapl_baselines.state_estimation.motion_belief import (
    Innovation,
    MotionBelief,
    accelerate,
    at_rest,
    choose,
    correct,
    innovate,
    predict,
)


@dataclass(frozen=True, kw_only=True, slots=True)
class PoseFilterConfig:
    """How noisy the poses are, and how bodies move.

    Attributes:
        position_sigma_m: Standard deviation of a measured position, each axis [m]. Measure your estimator's on a body
            that nobody touches.
        rotation_sigma_rad: The same of a rotation, about each axis [rad].
        linear_walk: Standard deviation of what a velocity gains in a second from unknown accelerations, each axis
            [m/s]; grows with the root of the time. A body in clutter rests or is pushed by jerks, so any value is a
            compromise: less is quieter at rest, more follows a push sooner. Of six values tried on pushed scenes at 10
            Hz, 0.05 is the least that follows moving bodies no worse than differences of poses do.
        angular_walk: The same of the angular velocity [rad/s].
        first_linear_sigma: How fast a body may move when it is first seen [m/s].
        first_angular_sigma: The same of the angular velocity [rad/s].
        max_speed_m_s: A measurement further from where its body was expected than this speed explains is not believed:
            another object was taken for it. The hand moves at 0.5 m/s at most, and nothing falls far.
        max_spin_rad_s: The same of a rotation [rad/s]: a box that tips over reaches 8, an estimate that flips by a
            quarter turn within 0.1 s looks like 16.
        max_coasted: Updates that a body without a believed measurement keeps its velocity. After more of them it is
            lost: it counts as resting, and starts anew where it is seen next. So a flip is skipped, and a lasting
            change of place is followed after so many updates.
    """

    position_sigma_m: float = 0.002
    rotation_sigma_rad: float = 0.02
    linear_walk: float = 0.05
    angular_walk: float = 0.5
    first_linear_sigma: float = 0.3
    first_angular_sigma: float = 2.0
    max_speed_m_s: float = 2.0
    max_spin_rad_s: float = 10.0
    max_coasted: int = 3

    def __post_init__(self) -> None:
        """Refuse what is no deviation and no speed."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not (np.isfinite(value) and (value > 0 or (value == 0 and field.name == "max_coasted"))):
                raise InvalidValueError(f"pose filter: {field.name} is {value}; give a positive number")


_DEVIATIONS = 5.0
"""What noise alone may add to a distance, in standard deviations."""


class PoseFilter:
    """Poses in, velocities out; each body is filtered on its own.

    Args:
        bodies: Shape of the bodies' axes: ``(4,)``, or ``(slots, objects)``.
        config: Noise and motion.

    Attributes:
        config: Noise and motion.
        belief: Poses and velocities as they are believed to be, with their covariance.
        is_tracked: Whether a body was seen and is not lost.
        surprise: Normalised innovation squared of the last measurement, NaN where there was none or it was not
            believed. If the settings fit, the median over bodies at rest is 5.3 (chi-square, six degrees of freedom).
    """

    def __init__(self, bodies: tuple[int, ...], config: PoseFilterConfig | None = None) -> None:
        self.config = config = config or PoseFilterConfig()
        self._pose_variance = _variance(config.position_sigma_m, config.rotation_sigma_rad)
        self._first_variance = _variance(config.first_linear_sigma, config.first_angular_sigma)
        self._acceleration = _variance(config.linear_walk, config.angular_walk)
        self.belief = self._see(np.broadcast_to([0.0, 0, 0, *IDENTITY_QUAT], (*bodies, 7)))
        self.is_tracked = np.zeros(bodies, dtype=bool)
        self.surprise = np.full(bodies, np.nan)
        self._coasted = np.zeros(bodies, dtype=np.int64)

    def forget(self, bodies: Bool[np.ndarray, "*body"]) -> None:
        """Lose bodies: they rest until their next measurement, which starts them anew."""
        self.is_tracked = self.is_tracked & ~bodies
        self.belief = choose(bodies, self._see(self.belief.poses), self.belief)

    def update(
        self,
        poses: Float64[np.ndarray, "*body 7"],
        dt_s: float,
        *,
        is_measured: Bool[np.ndarray, "*body"] | None = None,
    ) -> Float64[np.ndarray, "*body 6"]:
        """Take over the poses of one moment.

        Args:
            poses: Measured poses, body frame to world frame; sign and length of a quaternion do not matter.
            dt_s: Time since the last update [s]; need not be the same each time.
            is_measured: Which bodies were seen; by default, those whose poses are finite. Others' poses are not read.

        Returns:
            MuJoCo's velocities: linear in the world frame [m/s], angular in the body frame [rad/s].

        Raises:
            InvalidValueError: The time is not positive, or there are other bodies than before.
        """
        self._check(poses, dt_s)
        seen = np.all(np.isfinite(poses), axis=-1) & np.any(poses[..., 3:] != 0, axis=-1)
        seen = seen if is_measured is None else seen & is_measured
        starts = seen & ~self.is_tracked
        expected = accelerate(predict(self.belief, dt_s), dt_s, self._acceleration)
        poses = _with_unit_quats(np.where(seen[..., None], poses, expected.poses))
        innovation = innovate(expected, poses, self._pose_variance)
        believed = seen & self.is_tracked & self._is_plausible(innovation, dt_s)
        self.surprise = np.where(believed, innovation.squared(), np.nan)
        corrected = choose(believed, correct(expected, innovation, self._pose_variance), expected)
        self.belief = choose(starts, self._see(poses), corrected)
        self.is_tracked = self.is_tracked | starts
        self._coasted = np.where(believed | starts, 0, self._coasted + 1)
        self.forget(self._coasted > self.config.max_coasted)
        return self.belief.velocities.copy()

    def _see(self, poses: Float64[np.ndarray, "*body 7"]) -> MotionBelief:
        return at_rest(poses, self._pose_variance, self._first_variance)

    def _is_plausible(self, innovation: Innovation, dt_s: float) -> Bool[np.ndarray, "*body"]:
        """Whether a body can be so far from where it was expected."""
        config = self.config
        speeds = np.array([config.max_speed_m_s, config.max_spin_rad_s])
        noise = _DEVIATIONS * np.array([config.position_sigma_m, config.rotation_sigma_rad])
        parts = innovation.error.reshape(*innovation.error.shape[:-1], 2, 3)
        distances = np.sqrt((parts**2).sum(axis=-1))
        return np.all(distances <= dt_s * speeds + noise, axis=-1)

    def _check(self, poses: Float64[np.ndarray, "*any 7"], dt_s: float) -> None:
        if not (np.isfinite(dt_s) and dt_s > 0):
            raise InvalidValueError(f"the time between two updates is {dt_s} s; it must be positive")
        if poses.shape != self.belief.poses.shape:
            raise InvalidValueError(f"poses have shape {poses.shape}, expected {self.belief.poses.shape}")


def _with_unit_quats(poses: Float64[np.ndarray, "*body 7"]) -> Float64[np.ndarray, "*body 7"]:
    return np.concatenate([poses[..., :3], quat_normalize(poses[..., 3:])], axis=-1)


def _variance(first: float, second: float) -> Float64[np.ndarray, "6"]:
    return np.repeat([first, second], 3) ** 2
