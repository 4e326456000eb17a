"""Rolling plans out in copies of the true scene."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64, Int

from clutter6d.envs.action import ActionConfig, joint_targets
from clutter6d.envs.termination import TerminationConfig, goal_errors, is_at_goal, is_dropped
from clutter6d.scene import GoalPair
from clutter6d.sim.batch import SceneBatch
from clutter6d.sim.robot import hand_pose
from clutter6d.sim.scene_model import SceneModel
from dapl_baselines.planners.config import PlannerConfig
from dapl_baselines.planners.contact_points import ContactPoints, sample_contact_points
from dapl_baselines.planners.costs import disturbance_cost, fall_cost, goal_cost, reach_cost
from dapl_baselines.planners.hand_servo import tip_positions
from dapl_baselines.planners.pushes import Pushes

_REACH_POINTS = 64


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Rollouts:
    """What became of the plans of one round.

    Attributes:
        actions: Residuals as they were applied [rad].
        states: Simulation state after each control step.
        cost: Mean price of a control step.
        success_step: Control step at whose end the goal was reached first, or the horizon if it was not.
    """

    actions: Float32[np.ndarray, "sample step 7"]
    states: Float64[np.ndarray, "step sample state"]
    cost: Float64[np.ndarray, "sample"]
    success_step: Int[np.ndarray, "sample"]

    @property
    def best(self) -> int:
        """The rollout that succeeds first; among equals, and if none does, the cheapest."""
        return int(np.lexsort((self.cost, self.success_step))[0])

    @property
    def has_success(self) -> bool:
        """Whether any rollout reached the goal."""
        return bool(self.success_step.min() < len(self.states))


class RolloutSimulator:
    """Copies of one scene, with the task's costs. Steps exactly as the environment does, so plans come true to the bit.

    Args:
        scene_model: The scene.
        pair: The task.
        config: Numbers of samples and steps, and the costs.
        threads: Threads of the simulation; results do not depend on them.

    Attributes:
        contacts: Where the target can be touched.
        goal: The target's goal pose.
    """

    def __init__(self, scene_model: SceneModel, pair: GoalPair, config: PlannerConfig, *, threads: int) -> None:
        self._batch = SceneBatch([scene_model] * config.samples, threads=threads)
        self._config, self._action_config, self._termination = config, ActionConfig(), TerminationConfig()
        self._start_poses = pair.object_poses
        self.contacts: ContactPoints = sample_contact_points(scene_model.assets[0])
        self.goal = pair.goal.as_row()

    def set_state(self, state: Float64[np.ndarray, "state"]) -> None:
        """Put every copy into one state."""
        self._batch.states[:] = state

    @property
    def target_pose(self) -> Float64[np.ndarray, "7"]:
        """The target's pose in the first copy."""
        return self._batch.object_poses[0, 0].copy()

    def goal_cost(self, state: Float64[np.ndarray, "state"], rotation_weight: float) -> float:
        """Price of the distance to the goal in a state."""
        self._batch.states[0] = state
        return float(goal_cost(self._batch.object_poses[:1, 0], self.goal, rotation_weight, self._config.cost)[0])

    def is_dropped(self, state: Float64[np.ndarray, "state"]) -> bool:
        """Whether an object has fallen off the table in a state."""
        self._batch.states[0] = state
        return bool(is_dropped(self._batch.object_poses[:1], self._termination)[0])

    def run(
        self,
        state: Float64[np.ndarray, "state"],
        plans: Float64[np.ndarray, "plan step 7"],
        pushes: Pushes,
        rotation_weight: float,
    ) -> Rollouts:
        """Roll plans out from a state, and beside them pushes, which decide as they go.

        Args:
            state: Where every rollout starts.
            plans: Residuals of the first rollouts [rad].
            pushes: Controllers of the remaining ones.
            rotation_weight: Price of the rotation error [1/rad].
        """
        samples, horizon, first_push = self._config.samples, self._config.horizon_steps, len(plans)
        actions = np.zeros((samples, horizon, 7), dtype=np.float32)
        actions[:first_push] = plans
        states = np.empty((horizon, samples, len(state)))
        cost, success_step, dropped = np.zeros(samples), np.full(samples, horizon), np.zeros(samples, dtype=bool)
        scale = self._action_config.action_scale_rad
        self.set_state(state)
        for step in range(horizon):
            if first_push < samples:
                residuals = pushes.residuals(self._batch.arm_qpos[first_push:])
                actions[first_push:, step] = np.clip(residuals, -scale, scale)
            targets = joint_targets(actions[:, step], self._batch.arm_qpos, self._action_config)
            self._batch.joint_targets[:] = targets
            self._batch.step()
            states[step] = self._batch.states
            weight = self._config.cost.final_weight if step == horizon - 1 else 1.0
            cost += weight * self._step_cost(rotation_weight)
            success_step[self._has_succeeded() & (success_step == horizon) & ~dropped] = step
            dropped |= is_dropped(self._batch.object_poses, self._termination)
        cost /= horizon - 1 + self._config.cost.final_weight
        return Rollouts(actions=actions, states=states, cost=cost, success_step=success_step)

    def _has_succeeded(self) -> np.ndarray:
        poses = self._batch.object_poses[:, 0]
        errors = goal_errors(poses, np.broadcast_to(self.goal, poses.shape))
        return is_at_goal(errors.position_m, errors.rotation_rad, self._termination)

    def _step_cost(self, rotation_weight: float) -> Float64[np.ndarray, "sample"]:
        poses, cost = self._batch.object_poses, self._config.cost
        tips = tip_positions(hand_pose(self._batch.arm_qpos))
        return (
            goal_cost(poses[:, 0], self.goal, rotation_weight, cost)
            + reach_cost(tips, poses[:, 0], self.contacts.points[:_REACH_POINTS], cost)
            + disturbance_cost(poses, self._start_poses, cost)
            + fall_cost(poses, cost)
        )
