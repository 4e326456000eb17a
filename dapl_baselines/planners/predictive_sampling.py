"""The policy ``planner``: sampling-based predictive control in the simulator itself.

Privileged: it reads the true state and plans in copies of the true scene. It needs no training and is the strongest
reference of the benchmark; docs/planner.md says how it works and what it was measured to do.
"""

import dataclasses
import logging
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32, Float64, Int

from clutter6d.envs.termination import MAX_CONTROL_STEPS, goal_errors
from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import Episode, PolicyInput, PolicyOptions, identity_hash
from clutter6d.seeding import generator
from clutter6d.sim.scene_model import ARM_DOF, SceneModel, motion_in_states
from dapl_baselines.planners.config import PlannerConfig
from dapl_baselines.planners.rollouts import RolloutSimulator
from dapl_baselines.planners.search import Plan, search

_LOG = logging.getLogger(__name__)
_VERSION = 1


class EpisodePlanner:
    """Plans one episode: looks ahead, follows the plan while it comes true, plans again where it does not.

    Args:
        episode: The task.
        config: Settings.
        threads: Threads of the simulation.
    """

    def __init__(self, episode: Episode, config: PlannerConfig, *, threads: int) -> None:
        self._episode, self._config, self._threads = episode, config, threads
        self._plan: Plan | None = None
        self._planned_at = 0
        self._rounds = 0

    def act(self, step: int, state: Float64[np.ndarray, "state"]) -> Float32[np.ndarray, "7"]:
        """Residuals [rad] of one control step; none once the rounds of the episode are spent."""
        if not self._holds(step, state):
            if self._rounds >= self._config.max_rounds:
                return np.zeros(7, dtype=np.float32)
            self._search(step, state)
        if self._plan is None or step - self._planned_at >= len(self._plan.actions):
            return np.zeros(7, dtype=np.float32)
        return self._plan.actions[step - self._planned_at]

    def _holds(self, step: int, state: Float64[np.ndarray, "state"]) -> bool:
        done = step - self._planned_at
        if self._plan is None or done >= len(self._plan.actions):
            return False
        return is_on_course(self._episode.scene_model, self._plan.states[done], state, self._config)

    def _search(self, step: int, state: Float64[np.ndarray, "state"]) -> None:
        episode = self._episode

        def make_rng(attempt: int) -> np.random.Generator:
            return generator(episode.seed, "planner", episode.scene.scene_id, episode.pair_index, step, attempt)

        simulator = RolloutSimulator(episode.scene_model, episode.pair, self._config, threads=self._threads)
        self._plan = search(
            simulator,
            state,
            max_steps=MAX_CONTROL_STEPS - step,
            max_rounds=self._config.max_rounds - self._rounds,
            config=self._config,
            make_rng=make_rng,
        )
        self._planned_at, self._rounds = step, self._rounds + self._plan.rounds
        _LOG.info(
            "%s pair %d step %d: %d actions in %d rounds, %s",
            episode.scene.scene_id,
            episode.pair_index,
            step,
            len(self._plan.actions),
            self._plan.rounds,
            "reaches the goal" if self._plan.is_success else f"ends at goal cost {self._plan.goal_cost:.2f}",
        )


def is_on_course(
    scene_model: SceneModel,
    predicted: Float64[np.ndarray, "state"],
    actual: Float64[np.ndarray, "state"],
    config: PlannerConfig,
) -> bool:
    """Whether a state is near enough to a predicted one for the rest of its plan to hold."""
    if np.array_equal(predicted, actual):
        return True
    expected, found = (motion_in_states(state, scene_model.object_count)[0] for state in (predicted, actual))
    errors = goal_errors(expected[ARM_DOF:].reshape(-1, 7), found[ARM_DOF:].reshape(-1, 7))
    return bool(
        (errors.position_m < config.follow_position_m).all()
        and (errors.rotation_rad < config.follow_angle_rad).all()
        and (np.abs(expected[:ARM_DOF] - found[:ARM_DOF]) < config.follow_angle_rad).all()
    )


class PredictiveSamplingPolicy:
    """The planner as a policy; every slot is planned by itself, so slots cannot influence each other.

    Args:
        config: Settings.
        threads: Threads of the simulation; 0 for all cores.
    """

    name = "planner"
    is_privileged = True
    needs_observation = False

    def __init__(self, config: PlannerConfig | None = None, *, threads: int = 0) -> None:
        self.config = config or PlannerConfig()
        self.policy_hash = identity_hash(f"{self.name}-{_VERSION}", dataclasses.asdict(self.config))
        self._threads = threads
        self._planners: dict[int, EpisodePlanner] = {}

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:
        """Forget the plans of slots in which episodes start."""
        for slot, episode in zip(slots, episodes, strict=True):
            self._planners[int(slot)] = EpisodePlanner(episode, self.config, threads=self._threads)

    def act(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
        """Joint residuals [rad], one row for each slot.

        Raises:
            InvalidValueError: The input lacks the simulation's states.
        """
        if inputs.states is None:
            raise InvalidValueError("the planner is privileged: it needs the simulation's states in its input")
        rows = [
            self._planners[int(slot)].act(int(step), state)
            for slot, step, state in zip(inputs.slots, inputs.steps, inputs.states, strict=True)
        ]
        return np.stack(rows)


def make_policy(options: PolicyOptions) -> PredictiveSamplingPolicy:
    """The planner at full strength: ``--policy planner``."""
    return PredictiveSamplingPolicy(threads=options.threads)
