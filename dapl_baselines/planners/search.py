"""Predictive control run ahead of the episode: whole plans in imagination, with restarts.

The simulator is deterministic to the bit, so a plan found in a copy of the scene comes true in the scene. The planner
therefore runs its predictive control in the copy; if an attempt gets stuck it is dropped, at no cost to the episode,
and another one starts from the same state with other random numbers.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float32, Float64

from dapl_baselines.planners.config import PlannerConfig
from dapl_baselines.planners.pushes import draw_pushes
from dapl_baselines.planners.rollouts import Rollouts, RolloutSimulator

MAX_RESIDUAL_RAD = 0.1


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Plan:
    """Actions and the states they lead through.

    Attributes:
        actions: Residuals [rad].
        states: State before each action, and the last one's outcome.
        is_success: Whether the last state reaches the goal.
        goal_cost: Price of the distance to the goal in the last state.
        rounds: Rounds of rollouts it took.
    """

    actions: Float32[np.ndarray, "step 7"]
    states: Float64[np.ndarray, "step_and_end state"]
    is_success: bool
    goal_cost: float
    rounds: int


def search(
    simulator: RolloutSimulator,
    state: Float64[np.ndarray, "state"],
    *,
    max_steps: int,
    max_rounds: int,
    config: PlannerConfig,
    make_rng: Callable[[int], np.random.Generator],
) -> Plan:
    """Attempts from one state until one succeeds; else the one that ends nearest to the goal.

    Args:
        simulator: Copies of the scene.
        state: Where to start.
        max_steps: Control steps left in the episode.
        max_rounds: Rounds that may still be spent; at least one.
        config: Settings.
        make_rng: The generator of each attempt.
    """
    plans: list[Plan] = []
    for attempt in range(config.attempts):
        left = max_rounds - sum(plan.rounds for plan in plans)
        if left <= 0 or (plans and plans[-1].is_success):
            break
        weights = config.rotation_weights_per_rad
        weight = weights[attempt % len(weights)]
        plans.append(_attempt(simulator, state, max_steps, left, weight, config, make_rng(attempt)))
    best = min(plans, key=lambda plan: (not plan.is_success, plan.goal_cost))
    return replace(best, rounds=sum(plan.rounds for plan in plans))


def _attempt(
    simulator: RolloutSimulator,
    state: Float64[np.ndarray, "state"],
    max_steps: int,
    max_rounds: int,
    rotation_weight: float,
    config: PlannerConfig,
    rng: np.random.Generator,
) -> Plan:
    """Receding-horizon control until the goal, a drop, no more improvement, or until steps or rounds are spent.

    A failed attempt ends where it was nearest to the goal, measured with the first rotation weight.
    """
    actions, states = [np.zeros((0, 7), dtype=np.float32)], [state[None]]
    plan = np.zeros((config.horizon_steps, 7))
    best_cost, best_steps, steps = simulator.goal_cost(state, rotation_weight), 0, 0
    rounds = 0
    while steps < max_steps and rounds < max_rounds and steps - best_steps <= config.patience_steps:
        rollouts = _run_round(simulator, states[-1][-1], plan, rotation_weight, config, rng)
        best, rounds = rollouts.best, rounds + 1
        reached = int(rollouts.success_step[best])
        is_success = rollouts.has_success and steps + reached < max_steps
        count = reached + 1 if is_success else min(config.commit_steps, max_steps - steps)
        actions.append(rollouts.actions[best, :count])
        states.append(rollouts.states[:count, best])
        steps += count
        if is_success:
            return _finish(simulator, actions, states, steps, rounds, config, is_success=True)
        plan = _shift(rollouts.actions[best], count)
        if simulator.is_dropped(states[-1][-1]):
            break
        cost = simulator.goal_cost(states[-1][-1], rotation_weight)
        if cost < best_cost - config.improvement:
            best_cost, best_steps = cost, steps
    return _finish(simulator, actions, states, best_steps, rounds, config, is_success=False)


def _finish(
    simulator: RolloutSimulator,
    actions: list[Float32[np.ndarray, "_ 7"]],
    states: list[Float64[np.ndarray, "_ state"]],
    steps: int,
    rounds: int,
    config: PlannerConfig,
    *,
    is_success: bool,
) -> Plan:
    kept = np.concatenate(states)[: steps + 1]
    cost = simulator.goal_cost(kept[-1], config.rotation_weights_per_rad[0])
    return Plan(
        actions=np.concatenate(actions)[:steps], states=kept, is_success=is_success, goal_cost=cost, rounds=rounds
    )


def _run_round(
    simulator: RolloutSimulator,
    state: Float64[np.ndarray, "state"],
    plan: Float64[np.ndarray, "step 7"],
    rotation_weight: float,
    config: PlannerConfig,
    rng: np.random.Generator,
) -> Rollouts:
    """Roll out the plan, noisy versions of it, no motion at all, and pushes."""
    simulator.set_state(state)
    plans = _draw_plans(plan, config, rng)
    pushes = draw_pushes(simulator.contacts, simulator.target_pose, simulator.goal, config.pushes, config.push, rng)
    return simulator.run(state, plans, pushes, rotation_weight)


def _draw_plans(
    plan: Float64[np.ndarray, "step 7"], config: PlannerConfig, rng: np.random.Generator
) -> Float64[np.ndarray, "plan step 7"]:
    """The plan itself first, then standing still, then the plan, or none, with linear splines of noise."""
    count = config.samples - config.pushes
    position = np.linspace(0, config.knots - 1, config.horizon_steps)
    basis = np.maximum(0.0, 1.0 - np.abs(position[:, None] - np.arange(config.knots)))
    scale = config.noise_rad * rng.choice(np.array(config.noise_scales), size=(count, 1, 1))
    noise = np.einsum("sk,nkj->nsj", basis, scale * rng.normal(size=(count, config.knots, 7)))
    is_fresh = rng.random(count) < config.fresh_share
    noise[0], noise[1] = 0.0, 0.0
    is_fresh[0], is_fresh[1] = False, True
    start = np.where(is_fresh[:, None, None], 0.0, plan)
    return np.clip(start + noise, -MAX_RESIDUAL_RAD, MAX_RESIDUAL_RAD)


def _shift(actions: Float32[np.ndarray, "step 7"], count: int) -> Float64[np.ndarray, "step 7"]:
    """What is left of a plan after ``count`` steps, ended by half its last action."""
    tail = np.repeat(actions[-1:] / 2, count, axis=0)
    return np.concatenate([actions[count:], tail]).astype(np.float64)
