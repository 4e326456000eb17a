"""Slots that step together, each with a scene and a task of its own; the core of every environment and evaluation."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import mujoco.batch
import numpy as np
from jaxtyping import Bool, Float32, Float64, Int

from clutter6d.envs.action import ACTION_SIZE, joint_targets
from clutter6d.envs.control_mode import joint_residuals
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.observation import (
    BodyState,
    Observation,
    TaskArrays,
    make_observation,
)
from clutter6d.envs.observation_noise import ObservationNoise
from clutter6d.envs.point_kernel import compiled_point_clouds
from clutter6d.envs.randomisation import PhysicsDraw, vary_physics
from clutter6d.envs.reward import RewardTerms, compute_reward, finger_tips
from clutter6d.envs.termination import GoalErrors, goal_errors, is_dropped
from clutter6d.errors import InvalidValueError
from clutter6d.scene import GoalPair
from clutter6d.sim.batch import SceneBatch
from clutter6d.sim.kinematics import HandKinematics, hand_kinematics
from clutter6d.sim.model_variation import raise_poses
from clutter6d.sim.robot import JOINT_LOWER_RAD, JOINT_UPPER_RAD
from clutter6d.sim.scene_model import SceneModel

Slots = Int[np.ndarray, "slot"]
_MIN_SLOTS_PER_THREAD = 8


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Motion:
    """How far slots are in their episodes, beside what they were loaded with; one row a slot.

    Attributes:
        states: Full integration states.
        steps: Control steps made.
        previous_actions: Residuals asked for in the last step [rad].
        targets_before: Joint targets of the step before the last [rad], which an arm that hears late still follows.
    """

    states: Float64[np.ndarray, "slot state"]
    steps: Int[np.ndarray, "slot"]
    previous_actions: Float32[np.ndarray, "slot 7"]
    targets_before: Float64[np.ndarray, "slot 7"]


class ClutterSlots:
    """Slots that step together; what happens in one is the same to the bit whatever runs in the others.

    Args:
        scenes: A scene for each slot, all with as many objects.
        config: Actions, reward and termination.
        threads: Threads of the simulation and the observation; 0 for all cores.

    Attributes:
        batch: The simulation.
        start_poses: Poses of all objects at each slot's start.
        previous_actions: Residuals asked for in the last step [rad].
        steps: Control steps made since the start.
        table_heights_m: Height of each slot's table top.
    """

    def __init__(self, scenes: Sequence[SceneModel], config: EnvConfig | None = None, *, threads: int = 0) -> None:
        self.config = config or EnvConfig()
        self.batch = SceneBatch(scenes, threads=threads)
        self._task = TaskArrays.allocate(len(scenes), scenes[0].object_count)
        self.start_poses = self.batch.object_poses.copy()
        self.previous_actions = np.zeros((len(scenes), ACTION_SIZE), dtype=np.float32)
        self._hands_qpos = self.batch.arm_qpos.copy()
        self._last_hands = hand_kinematics(self._hands_qpos)
        self.steps = np.zeros(len(scenes), dtype=np.int64)
        self.table_heights_m = np.zeros(len(scenes))
        self._latency_steps = np.zeros(len(scenes), dtype=np.int64)
        self._targets_before = self.batch.joint_targets.copy()
        noise = self.config.noise
        self._noise = None if noise.is_silent else ObservationNoise(noise, len(scenes), scenes[0].object_count)
        self._threads = threads or len(os.sched_getaffinity(0))
        self._pool = ThreadPoolExecutor(self._threads) if self._threads > 1 else None

    @property
    def size(self) -> int:
        """Number of slots."""
        return self.batch.size

    @property
    def goals(self) -> Float64[np.ndarray, "slot 7"]:
        """Goal poses of all slots."""
        return self._task.goals

    def load(
        self,
        slots: Slots,
        scenes: Sequence[SceneModel],
        pairs: Sequence[GoalPair],
        *,
        physics: Sequence[PhysicsDraw] | None = None,
        noise_rngs: Sequence[np.random.Generator] | None = None,
    ) -> None:
        """Give slots scenes and tasks, and set them to the start.

        Args:
            slots: Which.
            scenes: Their scenes.
            pairs: Their tasks.
            physics: How the physics of each differ from the scene's; ``None``: not at all.
            noise_rngs: Where the errors of each slot's observation come from; needed if it has any.
        """
        heights = np.zeros(len(slots))
        if physics is not None:
            scenes = [vary_physics(scene, draw) for scene, draw in zip(scenes, physics, strict=True)]
            heights = np.array([draw.table_height_m for draw in physics])
            self._latency_steps[slots] = [draw.latency_steps for draw in physics]
        self.table_heights_m[slots] = heights
        self.batch.load(slots, scenes)
        for slot, scene, pair, height in zip(slots, scenes, pairs, heights, strict=True):
            self._task.load(int(slot), scene, pair.goal)
            self.start_poses[slot] = raise_poses(pair.object_poses, height)
            self.goals[slot] = raise_poses(self.goals[slot], height)
        if self._noise is not None and noise_rngs is not None:
            for slot, scene, rng in zip(slots, scenes, noise_rngs, strict=True):
                initial, goal = self.start_poses[slot, 0], self.goals[slot]
                self._noise.start(int(slot), rng, masses_kg=scene.object_masses_kg(), initial=initial, goal=goal)
        self.reset(slots)

    def reset(self, slots: Slots) -> None:
        """Set slots to the start of their task: stored poses at rest, the arm at home."""
        self.batch.reset(slots, self.start_poses[slots])
        self.previous_actions[slots] = 0
        self.steps[slots] = 0

    @property
    def motion(self) -> Motion:
        """How far all slots are in their episodes, to be taken up again."""
        return Motion(
            states=self.batch.states.copy(),
            steps=self.steps.copy(),
            previous_actions=self.previous_actions.copy(),
            targets_before=self._targets_before.copy(),
        )

    def take_up(self, motion: Motion) -> None:
        """Go on from where all slots were; they must have been loaded with the same scenes, tasks and physics.

        Raises:
            InvalidValueError: The motion is of other slots or of scenes with another number of objects.
        """
        if motion.states.shape != self.batch.states.shape:
            found, expected = motion.states.shape, self.batch.states.shape
            raise InvalidValueError(f"a motion of shape {found} cannot be taken up by slots of shape {expected}")
        self.batch.put(np.arange(self.size), motion.states)
        self.steps[:] = motion.steps
        self.previous_actions[:] = motion.previous_actions
        self._targets_before[:] = motion.targets_before

    def step(self, slots: Slots, actions: Float32[np.ndarray, "slot action"]) -> Bool[np.ndarray, "slot"]:
        """Command slots and advance them by one control step; returns which of them became unstable."""
        self.command(slots, actions)
        return self.advance(slots)

    def command(self, slots: Slots, actions: Float32[np.ndarray, "slot action"]) -> None:
        """Set the joint targets of slots, each once, from actions of the kind that the configuration names."""
        config, arm_qpos, jacobian = self.config.action, self.batch.arm_qpos[slots], self._hands().jacobian[slots]
        residuals = joint_residuals(actions, arm_qpos, config, jacobian=jacobian)
        self._targets_before[slots] = self.batch.joint_targets[slots]
        self.batch.joint_targets[slots] = joint_targets(residuals, arm_qpos, config, jacobian=jacobian)
        self.previous_actions[slots] = residuals

    def advance(self, slots: Slots) -> Bool[np.ndarray, "slot"]:
        """Simulate slots for one control step of 0.1 s with the joint targets they have.

        Returns:
            Which of them became unstable; they keep the state they had.
        """
        before = self.batch.states[slots]
        failed = np.zeros(self.size, dtype=bool)
        self.steps[slots] += 1
        try:
            if self._latency_steps.any():
                self.batch.step_delayed(slots, self._targets_before[slots], self._latency_steps[slots])
            else:
                self.batch.step(slots)
        except mujoco.batch.SimulationError as error:
            failed[error.ids] = True
        failed[self.batch.unstable_slots()] = True
        if failed.any():
            self.batch.put(slots[failed[slots]], before[failed[slots]])
        return failed[slots]

    def stop_arm(self, slots: Slots) -> None:
        """Hold the arm where it is: the joint targets of slots become the current angles, at most the joint limits."""
        self.batch.joint_targets[slots] = np.clip(self.batch.arm_qpos[slots], JOINT_LOWER_RAD, JOINT_UPPER_RAD)

    def errors(self, slots: Slots) -> GoalErrors:
        """How far the targets of slots are from their goals."""
        return goal_errors(self.batch.object_poses[slots, 0], self._task.goals[slots])

    def observe(self, slots: Slots | None = None) -> Observation[np.ndarray]:
        """Observations of slots (default: all), one row each."""
        rows = slice(None) if slots is None else slots
        state = BodyState(
            arm_qpos=self.batch.arm_qpos,
            arm_qvel=self.batch.arm_qvel,
            object_poses=self.batch.object_poses,
            object_velocities=self.batch.object_velocities,
        )
        make = partial(
            make_observation,
            previous_action=self.previous_actions[rows],
            hand=self._hands()[rows],
            make_clouds=partial(compiled_point_clouds, each_part=self._each_part),
        )
        if self._noise is None:
            return make(state[rows], self._task[rows])
        disturbed = np.arange(self.size) if slots is None else slots
        steps = self.steps[disturbed]
        seen, task = self._noise.disturb_inputs(disturbed, steps, state[disturbed], self._task[disturbed])
        return self._noise.disturb_points(disturbed, steps, make(seen, task))

    def is_dropped(self, slots: Slots) -> Bool[np.ndarray, "slot"]:
        """Whether any object of slots lies below its table."""
        above_table = raise_poses(self.batch.object_poses[slots], -self.table_heights_m[slots, None])
        return is_dropped(above_table, self.config.termination)

    def reward(self, slots: Slots | None = None) -> RewardTerms[np.ndarray]:
        """Reward of the present state of slots (default: all)."""
        rows = slice(None) if slots is None else slots
        return compute_reward(
            self.batch.object_poses[rows],
            self.start_poses[rows],
            self._task.goals[rows],
            finger_tips(self._hands()[rows].pose),
            self.config.reward,
        )

    def _hands(self) -> HandKinematics[np.ndarray]:
        """The kinematics of all hands, computed again only when an arm has moved."""
        if not np.array_equal(self._hands_qpos, self.batch.arm_qpos):
            self._hands_qpos = self.batch.arm_qpos.copy()
            self._last_hands = hand_kinematics(self._hands_qpos)
        return self._last_hands

    def _each_part(self, rows: int, fill: Callable[[slice], None]) -> None:
        """Call ``fill`` on parts of the rows, side by side where it pays."""
        parts = min(self._threads, rows // _MIN_SLOTS_PER_THREAD)
        if parts < 2 or self._pool is None:
            fill(slice(0, rows))
            return
        edges = np.linspace(0, rows, parts + 1).astype(int)
        list(self._pool.map(fill, [slice(int(a), int(b)) for a, b in pairwise(edges)]))
