"""Errors in what slots observe; the simulation and the true observation stay as they are."""

from dataclasses import replace
from typing import Final, cast

import numpy as np
from jaxtyping import Float64, Int

from clutter6d.envs.noise import NoiseConfig
from clutter6d.envs.observation import BodyState, Observation, TaskArrays
from clutter6d.errors import InvalidValueError
from clutter6d.geometry import quat_conjugate, quat_from_axis_angle, quat_multiply, rotate, rotation_error_rad

_LEAST_MASS: Final = 0.1
_MEASURED: Final = slice(None, None, 8)
"""The points of each object over which the mean speed is taken."""
_DRAWS_BITS: Final = 32
"""Numbers that one purpose may draw at one step, as a power of two."""


class ObservationNoise:
    """The errors of slots; a slot's depend on its episode's generator and on the step, never on the other slots.

    Args:
        config: How wrong.
        slots: Number of slots.
        objects: Objects in each.
    """

    def __init__(self, config: NoiseConfig, slots: int, objects: int) -> None:
        self.config = config
        self._streams: dict[int, _Stream] = {}
        self._mass_factor = np.ones((slots, objects))
        self._goal_sigma = np.zeros((slots, 2))

    def start(
        self,
        slot: int,
        rng: np.random.Generator,
        *,
        masses_kg: Float64[np.ndarray, "object"],
        initial: Float64[np.ndarray, "7"],
        goal: Float64[np.ndarray, "7"],
    ) -> None:
        """Begin an episode: draw what lasts for all of it.

        Args:
            slot: Which.
            rng: From the seed, the scene, the pair and the episode's number; the slot keeps it.
            masses_kg: True masses of the objects.
            initial: The target's initial pose.
            goal: Its goal pose.
        """
        stream = self._streams[slot] = _Stream(rng)
        error = self.config.mass * masses_kg.mean() * stream.at(0, "mass").standard_normal(len(masses_kg))
        self._mass_factor[slot] = np.maximum(1 + error / masses_kg, _LEAST_MASS)
        distance = np.sqrt(((goal[:3] - initial[:3]) ** 2).sum())
        angle = float(rotation_error_rad(initial[3:], goal[3:]))
        self._goal_sigma[slot] = self.config.goal_pose * np.array([distance, angle]) / np.sqrt(3)

    def disturb_inputs(
        self,
        slots: Int[np.ndarray, "slot"],
        steps: Int[np.ndarray, "slot"],
        state: BodyState[np.ndarray],
        task: TaskArrays[np.ndarray],
    ) -> tuple[BodyState[np.ndarray], TaskArrays[np.ndarray]]:
        """What the slots take their state and task to be; the very arguments where nothing is disturbed.

        Args:
            slots: Which.
            steps: Control steps each has made in its episode; the same step is disturbed in the same way again.
            state: Their true state, one row each.
            task: Their true task, one row each.
        """
        if self.config.velocity > 0:
            state = replace(state, object_velocities=self._wrong_velocities(slots, steps, state, task))
        if self.config.goal_pose > 0:
            task = replace(task, goals=self._wrong_goals(slots, steps, task.goals))
        if self.config.mass > 0:
            for slot in slots:
                self._stream_of(int(slot))
            factor, physics = self._mass_factor[slots].astype(np.float32), task.physics.copy()
            physics[:, 0] *= factor[:, 0]
            task = replace(
                task, clouds=replace(task.clouds, point_mass=task.clouds.point_mass * factor), physics=physics
            )
        return state, task

    def disturb_points(
        self, slots: Int[np.ndarray, "slot"], steps: Int[np.ndarray, "slot"], observation: Observation[np.ndarray]
    ) -> Observation[np.ndarray]:
        """The observation with each object's point off on its own; the very argument where nothing is disturbed.

        The end effector's points are not touched: the arm knows where it is.
        """
        if not self.config.disturbs_points:
            return observation
        sigma = np.repeat([self.config.coordinates_m, self.config.velocities_m_s], 3).astype(np.float32)
        target, obstacles = observation["object_points"].copy(), observation["environment_points"].copy()
        for row, (slot, step) in enumerate(zip(slots, steps, strict=True)):
            rng = self._stream_of(int(slot)).at(int(step), "points")
            for points in (target, obstacles):
                error = sigma * rng.standard_normal((len(points[row]), 6), dtype=np.float32)
                points[row, :, :3] += error[:, :3]
                points[row, :, 4:] += error[:, 3:]
        return {**observation, "object_points": target, "environment_points": obstacles}

    def _stream_of(self, slot: int) -> "_Stream":
        """The random numbers of a slot's episode.

        Raises:
            InvalidValueError: It has none yet.
        """
        if slot not in self._streams:
            raise InvalidValueError(f"slot {slot} shall be seen with noise and has no episode yet; call start() first")
        return self._streams[slot]

    def _wrong_velocities(
        self,
        slots: Int[np.ndarray, "slot"],
        steps: Int[np.ndarray, "slot"],
        state: BodyState[np.ndarray],
        task: TaskArrays[np.ndarray],
    ) -> Float64[np.ndarray, "slot object 6"]:
        points = task.clouds.points[..., _MEASURED].astype(np.float64)
        sigma = self.config.velocity * _mean_speed(points, state)
        radius = np.sqrt((points * points).sum(axis=2).mean(axis=2))
        shape = state.object_velocities.shape[1:]
        error = self._normal(slots, steps, "velocity", shape)
        error[..., :3] *= sigma[:, None, None] / np.sqrt(6)
        error[..., 3:] *= (sigma[:, None] / (2 * radius))[..., None]
        return state.object_velocities + error

    def _wrong_goals(
        self, slots: Int[np.ndarray, "slot"], steps: Int[np.ndarray, "slot"], goals: Float64[np.ndarray, "slot 7"]
    ) -> Float64[np.ndarray, "slot 7"]:
        error = self._normal(slots, steps, "goal", (2, 3)) * self._goal_sigma[slots][..., None]
        angle = np.sqrt((error[:, 1] ** 2).sum(axis=1))
        axis = error[:, 1] / np.where(angle > 0, angle, 1.0)[:, None]
        turned = quat_multiply(quat_from_axis_angle(axis, angle), goals[:, 3:])
        return np.concatenate([goals[:, :3] + error[:, 0], turned], axis=1)

    def _normal(
        self, slots: Int[np.ndarray, "slot"], steps: Int[np.ndarray, "slot"], lane: str, shape: tuple[int, ...]
    ) -> np.ndarray:
        draws = [
            self._stream_of(int(s)).at(int(t), lane).standard_normal(shape) for s, t in zip(slots, steps, strict=True)
        ]
        return np.stack(draws) if draws else np.empty((0, *shape))


class _Stream:
    """An episode's random numbers, which can be drawn for any step in any order."""

    _LANES = ("mass", "velocity", "goal", "points")

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng, self._bits = rng, cast(np.random.PCG64, rng.bit_generator)
        self._start = self._bits.state

    def at(self, step: int, lane: str) -> np.random.Generator:
        """The generator of one purpose at one step."""
        self._bits.state = self._start
        self._bits.advance((len(self._LANES) * step + self._LANES.index(lane)) << _DRAWS_BITS)
        return self._rng


def _mean_speed(
    points: Float64[np.ndarray, "slot object 3 point"], state: BodyState[np.ndarray]
) -> Float64[np.ndarray, "slot"]:
    """Mean speed of the points, given in the object frames, of all objects [m/s]."""
    linear = rotate(quat_conjugate(state.object_poses[..., 3:]), state.object_velocities[..., :3])
    spin = state.object_velocities[..., 3:]
    squared = np.zeros(points.shape[:2] + points.shape[3:])
    for axis in range(3):
        second, third = (axis + 1) % 3, (axis + 2) % 3
        turning = spin[..., second, None] * points[:, :, third] - spin[..., third, None] * points[:, :, second]
        squared += (linear[..., axis, None] + turning) ** 2
    return np.sqrt(squared).mean(axis=2).mean(axis=1)
