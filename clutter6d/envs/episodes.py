"""Episodes in slots: which task each slot runs, how far it is, and how it ends."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.reward import RewardTerms
from clutter6d.envs.slots import ClutterSlots, Slots
from clutter6d.envs.tasks import Task, TaskSource
from clutter6d.envs.termination import GoalErrors, Outcome, find_outcome, is_at_goal, is_dropped
from clutter6d.envs.unstable_state import report_unstable


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StepResult:
    """What came of one control step; row ``i`` belongs to the ``i``-th slot that was stepped.

    Attributes:
        reward: The reward's terms.
        errors: How far the targets are from their goals.
        outcomes: How the episode ended, or ``None`` while it goes on.
    """

    reward: RewardTerms
    errors: GoalErrors
    outcomes: tuple[Outcome | None, ...]


class EpisodeSlots:
    """Slots that run one episode after another.

    Args:
        source: Where the tasks come from.
        size: Slots.
        config: Actions, reward and termination.
        threads: Threads of simulation and observation; 0 for all cores.
        unstable_dir: Where the state before an invalid step is kept.

    Attributes:
        core: The simulation.
        steps: Control steps made in each slot's episode.
    """

    def __init__(
        self, source: TaskSource, size: int, config: EnvConfig, *, threads: int = 0, unstable_dir: Path | None = None
    ) -> None:
        first = source.first()
        self.core = ClutterSlots([first.model] * size, config, threads=threads)
        self.steps = np.zeros(size, dtype=np.int64)
        self._source, self._unstable_dir = source, unstable_dir
        self._tasks = [first] * size
        self._seeds, self._numbers = [0] * size, [0] * size

    @property
    def tasks(self) -> tuple[Task, ...]:
        """The task of each slot."""
        return tuple(self._tasks)

    def seed(self, slot: int, seed: int) -> None:
        """Start a slot's stream of tasks anew."""
        self._seeds[slot], self._numbers[slot] = seed, 0

    def draw(self, slot: int) -> Task:
        """The next task of a slot's stream."""
        task = self._source.draw(self._seeds[slot], self._numbers[slot])
        self._numbers[slot] += 1
        return task

    def choose(self, scene_id: str, pair: int) -> Task:
        """A task by name; errors as :meth:`TaskSource.choose`."""
        return self._source.choose(scene_id, pair)

    def begin(self, slots: Slots, tasks: Sequence[Task]) -> None:
        """Start episodes."""
        for slot, task in zip(slots, tasks, strict=True):
            self._tasks[slot] = task
        self.core.load(slots, [task.model for task in tasks], [task.pair for task in tasks])
        self.steps[slots] = 0

    def step(self, slots: Slots, actions: Float32[np.ndarray, "slot action"]) -> StepResult:
        """Advance slots by one control step; a slot whose step is invalid keeps the state before."""
        is_unstable = self.core.step(slots, actions)
        for slot in slots[is_unstable]:
            self._report(int(slot))
        self.steps[slots] += 1
        errors, config = self.core.errors(slots), self.core.config.termination
        outcomes = find_outcome(
            is_success=is_at_goal(errors.position_m, errors.rotation_rad, config),
            dropped=is_dropped(self.core.batch.object_poses[slots], config),
            is_unstable=is_unstable,
            steps=self.steps[slots],
            config=config,
        )
        return StepResult(reward=self.core.reward(slots), errors=errors, outcomes=outcomes)

    def _report(self, slot: int) -> None:
        task, state = self._tasks[slot], self.core.batch.states[slot]
        key = task.scene.scene_id, task.pair_index
        report_unstable(self._source.sha256, key, int(self.steps[slot]), state, self._unstable_dir)
