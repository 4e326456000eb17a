"""Episodes in which a teacher practises: pushes are chosen, carried out, and remembered."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int
from torch import Tensor

from clutter6d.envs.slots import Slots
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.candidates import draw_candidates
from dapl_baselines.push_policy.choice import choose, judge
from dapl_baselines.push_policy.critic import PushCritic
from dapl_baselines.push_policy.push_slots import Ends, PushSlots
from dapl_baselines.push_policy.push_state import STATE_FIELDS, PushState
from dapl_baselines.push_policy.seen import Seen
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.replay import Replay
from dapl_baselines.teacher.settings import TeacherSettings
from dapl_baselines.teacher.transitions import NO_LATER, Transitions
from dapl_baselines.validation import SceneSubset


@dataclass(kw_only=True, slots=True, eq=False)
class Pending:
    """The pushes that are being carried out, and when they were chosen; one row a slot.

    Attributes:
        state: Where things were.
        pushes: What was chosen.
        steps: Control steps the episodes had made.
        last: Number of the same episode's last transition, or ``NO_LATER``.
        must_choose: Whether a push must be chosen.
    """

    state: PushState[np.ndarray]
    pushes: Float64[np.ndarray, "slot column"]
    steps: Int[np.ndarray, "slot"]
    last: Int[np.ndarray, "slot"]
    must_choose: Bool[np.ndarray, "slot"]


class Practice:
    """Slots in which a critic, or chance, chooses.

    Args:
        scenes: What is trained on.
        shapes: Shapes of all their targets.
        settings: Of the training.
        threads: Threads of the simulation; 0 for all cores.

    Attributes:
        slots: The episodes.
        pending: What is carried out in them.
    """

    def __init__(
        self, scenes: SceneSubset, shapes: TargetShapes, settings: TeacherSettings, *, threads: int = 0
    ) -> None:
        self._settings, self._shapes, size = settings, shapes, settings.slots
        self.slots = PushSlots(scenes, shapes, settings.env(), size=size, seed=settings.seed, threads=threads)
        self._is_random = np.arange(size) < round(size * settings.random_slots)
        self.pending = Pending(
            state=self.slots.see().state,
            pushes=np.zeros((size, columns.SIZE)),
            steps=np.zeros(size, dtype=np.int64),
            last=np.full(size, NO_LATER),
            must_choose=np.ones(size, dtype=bool),
        )

    def blank_rows(self) -> dict[str, Tensor]:
        """Rows of the replay that say nothing, for their sizes."""
        size = len(self.pending.steps)
        nothing = np.zeros(size, dtype=bool)
        ends = Ends(is_success=nothing, is_drop=nothing, is_over=nothing, push=nothing)
        return self._transitions(np.arange(size), self.slots.see(), ends).to_rows()

    def run(self, critic: PushCritic, replay: Replay, rng: np.random.Generator) -> int:
        """The control steps of one iteration; returns how many pushes were over."""
        before = replay.count
        for _ in range(self._settings.steps):
            self._step(critic, replay, rng)
        return replay.count - before

    def _step(self, critic: PushCritic, replay: Replay, rng: np.random.Generator) -> None:
        seen = self.slots.see()
        choosing = np.flatnonzero(self.pending.must_choose)
        if len(choosing):
            self._choose(choosing, seen, critic, rng)
        ends = self.slots.step(seen, ~self._is_random)
        if ends.push.any():
            self._remember(np.flatnonzero(ends.push), ends, replay)
        if ends.is_over.any():
            self.slots.begin(np.flatnonzero(ends.is_over))
            self.pending.last[ends.is_over] = NO_LATER
        self.pending.must_choose = ends.push

    def _choose(self, slots: Slots, seen: Seen, critic: PushCritic, rng: np.random.Generator) -> None:
        """The best of some pushes by the critic, or any of them."""
        there = seen.rows(slots)
        state, goals, targets = there.state, there.goals, there.targets
        drawn = draw_candidates(state, goals, self._shapes, targets, self._settings.practice_counts, rng)
        values = judge(critic, state, goals, self._shapes.surface[targets], drawn)
        origins, around = state.poses[:, :3], there.points_in_the_way()
        best = choose(values, drawn, lambda pushes: self.slots.tracker.may_begin(slots, pushes, origins, around))
        is_random = self._is_random[slots] | (rng.random(len(slots)) < self._settings.random_share)
        chosen = np.where(is_random, rng.integers(drawn.shape[1], size=len(slots)), best)
        pushes = drawn[np.arange(len(slots)), chosen]
        self.slots.tracker.begin(slots, pushes, state.poses[:, :3])
        for name in STATE_FIELDS:
            getattr(self.pending.state, name)[slots] = getattr(state, name)
        self.pending.pushes[slots], self.pending.steps[slots] = pushes, self.slots.steps[slots]

    def _remember(self, slots: Slots, ends: Ends, replay: Replay) -> None:
        """The pushes that are over, each told where its episode goes on."""
        numbers, before = replay.count + np.arange(len(slots)), self.pending.last[slots]
        replay.add(self._transitions(slots, self.slots.see(), ends).to_rows())
        has_before = (before != NO_LATER) & (before >= replay.oldest)
        replay.put("later", before[has_before], numbers[has_before])
        self.pending.last[slots] = numbers

    def _transitions(self, slots: Slots, after: Seen, ends: Ends) -> Transitions:
        return Transitions(
            before=self.pending.state.rows(slots),
            after=after.state.rows(slots),
            goals=after.goals[slots],
            pushes=self.pending.pushes[slots],
            steps=self.slots.steps[slots] - self.pending.steps[slots],
            is_success=ends.is_success[slots],
            is_drop=ends.is_drop[slots],
            targets=after.targets[slots],
            later=np.full(len(slots), NO_LATER),
            weights=np.ones(len(slots)),
        )
