"""Slots that step together, each with a scene and a task of its own; the core of every environment and evaluation."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import mujoco.batch
import numpy as np
from jaxtyping import Bool, Float32, Float64, Int

from clutter6d.envs.action import ACTION_SIZE, joint_targets
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.observation import (
    BodyState,
    Observation,
    TaskArrays,
    make_observation,
)
from clutter6d.envs.reward import RewardTerms, compute_reward
from clutter6d.envs.termination import GoalErrors, goal_errors
from clutter6d.geometry import transform_points
from clutter6d.scene import GoalPair
from clutter6d.sim.batch import SceneBatch
from clutter6d.sim.end_effector import FINGERS
from clutter6d.sim.robot import JOINT_LOWER_RAD, JOINT_UPPER_RAD, hand_pose
from clutter6d.sim.robot_facts import TIP_OFFSET_M
from clutter6d.sim.scene_model import SceneModel

Slots = Int[np.ndarray, "slot"]
_FINGER_TIPS = np.array([[0.0, finger.centre_m[1], TIP_OFFSET_M] for finger in FINGERS])
_MIN_SLOTS_PER_THREAD = 8


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
    """

    def __init__(self, scenes: Sequence[SceneModel], config: EnvConfig | None = None, *, threads: int = 0) -> None:
        self.config = config or EnvConfig()
        self.batch = SceneBatch(scenes, threads=threads)
        self._task = TaskArrays.allocate(len(scenes), scenes[0].object_count)
        self.start_poses = self.batch.object_poses.copy()
        self.previous_actions = np.zeros((len(scenes), ACTION_SIZE), dtype=np.float32)
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

    def load(self, slots: Slots, scenes: Sequence[SceneModel], pairs: Sequence[GoalPair]) -> None:
        """Give slots scenes and tasks, and set them to the start."""
        self.batch.load(slots, scenes)
        for slot, scene, pair in zip(slots, scenes, pairs, strict=True):
            self._task.load(int(slot), scene, pair.goal)
            self.start_poses[slot] = pair.object_poses
        self.reset(slots)

    def reset(self, slots: Slots) -> None:
        """Set slots to the start of their task: stored poses at rest, the arm at home."""
        self.batch.reset(slots, self.start_poses[slots])
        self.previous_actions[slots] = 0

    def step(self, slots: Slots, actions: Float32[np.ndarray, "slot 7"]) -> Bool[np.ndarray, "slot"]:
        """Command slots and advance them by one control step; returns which of them became unstable."""
        self.command(slots, actions)
        return self.advance(slots)

    def command(self, slots: Slots, actions: Float32[np.ndarray, "slot 7"]) -> None:
        """Set the joint targets of slots from joint residuals [rad]; each slot once."""
        self.batch.joint_targets[slots] = joint_targets(actions, self.batch.arm_qpos[slots], self.config.action)
        self.previous_actions[slots] = actions

    def advance(self, slots: Slots) -> Bool[np.ndarray, "slot"]:
        """Simulate slots for one control step of 0.1 s with the joint targets they have.

        Returns:
            Which of them became unstable; they keep the state they had.
        """
        before = self.batch.states[slots]
        failed = np.zeros(self.size, dtype=bool)
        try:
            self.batch.step(slots)
        except mujoco.batch.SimulationError as error:
            failed[error.ids] = True
        failed[self.batch.unstable_slots()] = True
        self.batch.states[slots[failed[slots]]] = before[failed[slots]]
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
        return make_observation(state[rows], self._task[rows], self.previous_actions[rows])

    def reward(self, slots: Slots | None = None) -> RewardTerms:
        """Reward of the present state of slots (default: all)."""
        rows = slice(None) if slots is None else slots
        tips = transform_points(hand_pose(self.batch.arm_qpos[rows]), _FINGER_TIPS)
        poses = self.batch.object_poses[rows]
        return compute_reward(poses, self.start_poses[rows], self._task.goals[rows], tips, self.config.reward)

    def _each_part(self, rows: int, fill: Callable[[slice], None]) -> None:
        """Call ``fill`` on parts of the rows, side by side where it pays."""
        parts = min(self._threads, rows // _MIN_SLOTS_PER_THREAD)
        if parts < 2 or self._pool is None:
            fill(slice(0, rows))
            return
        edges = np.linspace(0, rows, parts + 1).astype(int)
        list(self._pool.map(fill, [slice(int(a), int(b)) for a, b in pairwise(edges)]))
