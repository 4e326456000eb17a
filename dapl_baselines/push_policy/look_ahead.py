"""Trying pushes in copies of the simulation before one is carried out.

A teacher may: it knows the true state. What it sees there comes true to the bit, because the copies are stepped as the
environment is.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int

from clutter6d.envs.action import ActionConfig, joint_targets
from clutter6d.envs.observation import BodyState
from clutter6d.envs.termination import TerminationConfig, goal_errors, is_at_goal, is_dropped
from clutter6d.sim.batch import SceneBatch
from clutter6d.sim.kinematics import HandKinematics, hand_kinematics
from clutter6d.sim.scene_model import SceneModel
from dapl_baselines.push_policy.push_state import PushState, SceneFacts, read_push_state
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.push_policy.tracker import PushTracker


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Tried:
    """What became of pushes; one row each.

    Attributes:
        after: Where things were when they were over.
        steps: Control steps that they took.
        is_success: Whether they ended at the goal.
        is_drop: Whether they ended with an object off the table.
    """

    after: PushState[np.ndarray]
    steps: Int[np.ndarray, "push"]
    is_success: Bool[np.ndarray, "push"]
    is_drop: Bool[np.ndarray, "push"]


class LookAhead:
    """Copies of one scene.

    Args:
        scene: The scene.
        pushes: How many pushes are tried at once.
        threads: Threads of the simulation; 0 for all cores. Results do not depend on them.
    """

    def __init__(self, scene: SceneModel, pushes: int, *, threads: int = 0) -> None:
        self._batch = SceneBatch([scene] * pushes, threads=threads)
        self._all, self._targets = np.arange(pushes), np.zeros(pushes, dtype=np.int64)
        self._shapes, self._facts = TargetShapes.of(scene.assets[:1]), SceneFacts.of([scene] * pushes)
        self._action, self._termination = ActionConfig(), TerminationConfig()

    def try_out(
        self,
        state: Float64[np.ndarray, "state"],
        pushes: Float64[np.ndarray, "push column"],
        goal: Float64[np.ndarray, "7"],
        max_steps: int,
    ) -> Tried:
        """Carry out every push from the same state.

        Args:
            state: The full integration state.
            pushes: As many as there are copies.
            goal: Where the target shall go.
            max_steps: Control steps that are left of the episode.
        """
        batch, tracker = self._batch, PushTracker(size=len(self._all))
        batch.put(self._all, np.tile(state, (len(self._all), 1)))
        tracker.begin(self._all, pushes, batch.object_poses[:, 0, :3])
        steps, goals = np.zeros(len(self._all), dtype=np.int64), np.tile(goal, (len(self._all), 1))
        is_success, is_drop = np.zeros((2, len(self._all)), dtype=bool)
        running = self._all
        while len(running):
            self._step(tracker, running)
            steps[running] += 1
            errors = goal_errors(batch.object_poses[:, 0], goals)
            is_success[running] = is_at_goal(errors.position_m, errors.rotation_rad, self._termination)[running]
            is_drop[running] = is_dropped(batch.object_poses, self._termination)[running] & ~is_success[running]
            is_over = tracker.is_over() | is_success | is_drop | (steps >= max_steps)
            running = running[~is_over[running]]
        after = read_push_state(self._bodies(), hand_kinematics(batch.arm_qpos), self._facts)
        return Tried(after=after, steps=steps, is_success=is_success, is_drop=is_drop)

    def _step(self, tracker: PushTracker, running: Int[np.ndarray, "running"]) -> None:
        """One control step of the pushes that are not over; the others' trackers run on unheard."""
        batch, hand = self._batch, hand_kinematics(self._batch.arm_qpos)
        contacts = self._shapes.placed_contacts(self._targets, batch.object_poses[:, 0])
        around = np.concatenate([contacts, self._facts.placed_surfaces(batch.object_poses)], axis=1)
        residuals = tracker.residuals(hand, batch.arm_qpos, batch.arm_qvel, around, self._action).astype(np.float32)
        targets = self._joint_targets(residuals, hand)
        batch.joint_targets[running] = targets[running]
        batch.step(running)

    def _joint_targets(self, residuals: np.ndarray, hand: HandKinematics[np.ndarray]) -> Float64[np.ndarray, "push 7"]:
        return joint_targets(residuals, self._batch.arm_qpos, self._action, jacobian=hand.jacobian)

    def _bodies(self) -> BodyState[np.ndarray]:
        batch = self._batch
        return BodyState(
            arm_qpos=batch.arm_qpos,
            arm_qvel=batch.arm_qvel,
            object_poses=batch.object_poses,
            object_velocities=batch.object_velocities,
        )
