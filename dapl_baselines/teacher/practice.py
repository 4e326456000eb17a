"""Episodes in which a teacher practises: pushes are chosen, carried out, and remembered."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import torch
from jaxtyping import Bool, Float64, Int
from torch import Tensor

from clutter6d.envs.episode_streams import EpisodeStreams, StreamPlaces
from clutter6d.envs.episodes import EpisodeSlots, StepResult
from clutter6d.envs.observation import BodyState
from clutter6d.envs.slots import Motion, Slots
from clutter6d.envs.tasks import TaskSource
from clutter6d.sim.kinematics import HandKinematics, hand_kinematics
from clutter6d.sim.model_variation import let_sleep
from dapl_baselines.policy.episode_tally import EpisodeTally
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.candidates import draw_candidates
from dapl_baselines.push_policy.choice import judge
from dapl_baselines.push_policy.critic import PushCritic
from dapl_baselines.push_policy.push_state import STATE_FIELDS, PushState, SceneFacts, read_push_state
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.push_policy.tracker import PushTracker
from dapl_baselines.replay import Replay
from dapl_baselines.teacher.settings import TeacherSettings
from dapl_baselines.teacher.transitions import NO_LATER, Transitions
from dapl_baselines.validation import SceneSubset

LOST_M: Final = np.array([0.48, 0.68])
"""A target beyond these |x|, |y|, 2 cm from the table's edge, is taken for dropped: nothing is learned from there."""


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
    """Slots that practise on scenes whose objects may sleep.

    Args:
        scenes: What is trained on.
        shapes: Shapes of all their targets.
        settings: Of the training.
        replay: Where transitions go.
        threads: Threads of the simulation; 0 for all cores.

    Attributes:
        tally: What became of the episodes in which pushes are chosen.
    """

    def __init__(
        self, scenes: SceneSubset, shapes: TargetShapes, settings: TeacherSettings, *, threads: int = 0
    ) -> None:
        self._settings, self._shapes, size = settings, shapes, settings.slots
        source = TaskSource(scenes, kept_models=len(scenes.scenes), prepare=let_sleep)
        self._streams = EpisodeStreams(source, size, settings.env())
        self._streams.seed([settings.seed + slot for slot in range(size)])
        self._episodes = EpisodeSlots(self._streams, settings.env(), threads=threads)
        self._all = np.arange(size)
        self._is_random = self._all < round(size * settings.random_slots)
        self._facts = SceneFacts.of([task.model for task in self._streams.tasks])
        self._targets = np.zeros(size, dtype=np.int64)
        self.tracker, self.tally = PushTracker(size=size), EpisodeTally(size, torch.device("cpu"))
        self._begin(self._all)
        state, _ = self._look()
        self.pending = Pending(
            state=state,
            pushes=np.zeros((size, columns.SIZE)),
            steps=np.zeros(size, dtype=np.int64),
            last=np.full(size, NO_LATER),
            must_choose=np.ones(size, dtype=bool),
        )

    def blank_rows(self) -> dict[str, Tensor]:
        """Rows of the replay that say nothing, for their sizes."""
        nothing = np.zeros(len(self._all), dtype=bool)
        return self._transitions(self._all, self.pending.state, nothing, nothing).to_rows()

    def run(self, critic: PushCritic, replay: Replay, rng: np.random.Generator) -> int:
        """The control steps of one iteration; returns how many pushes were over."""
        before = replay.count
        for _ in range(self._settings.steps):
            self._step(critic, replay, rng)
        return replay.count - before

    @property
    def places(self) -> StreamPlaces:
        """Which episodes the slots run."""
        return self._streams.places

    def pause(self) -> Motion:
        """Where the episodes are; whoever goes on from here and whoever is put back to here goes on alike.

        Who sleeps is not part of a state, so all are woken up.
        """
        motion = self._episodes.core.motion
        self._episodes.core.take_up(motion)
        return motion

    def return_to(self, places: StreamPlaces, motion: Motion) -> None:
        """Go on with the episodes that ran when these were read."""
        self._episodes.return_to(places, motion)
        self._read_facts(self._all)

    def _step(self, critic: PushCritic, replay: Replay, rng: np.random.Generator) -> None:
        state, hand = self._look()
        choosing = np.flatnonzero(self.pending.must_choose)
        if len(choosing):
            self._choose(choosing, state.rows(choosing), critic, rng)
        around = self._shapes.placed_contacts(self._targets, state.poses)
        qvel, action = self._episodes.core.batch.arm_qvel, self._settings.env().action
        residuals = self.tracker.residuals(hand, qvel, around, action)
        result = self._episodes.step(self._all, residuals.astype(np.float32))
        self._take_note(result, replay)

    def _choose(self, slots: Slots, state: PushState[np.ndarray], critic: PushCritic, rng: np.random.Generator) -> None:
        """The best of some pushes by the critic, or any of them."""
        goals, targets = self._episodes.core.goals[slots], self._targets[slots]
        drawn = draw_candidates(state, goals, self._shapes, targets, self._settings.practice_counts, rng)
        best = judge(critic, state, goals, self._shapes.surface[targets], drawn).argmax(axis=1)
        is_random = self._is_random[slots] | (rng.random(len(slots)) < self._settings.random_share)
        chosen = np.where(is_random, rng.integers(drawn.shape[1], size=len(slots)), best)
        pushes = drawn[np.arange(len(slots)), chosen]
        self.tracker.begin(slots, pushes, state.poses[:, :3])
        for name in STATE_FIELDS:
            getattr(self.pending.state, name)[slots] = getattr(state, name)
        self.pending.pushes[slots], self.pending.steps[slots] = pushes, self._episodes.core.steps[slots]

    def _take_note(self, result: StepResult, replay: Replay) -> None:
        """Remember the pushes that are over, and begin anew where episodes are."""
        xy = np.abs(self._episodes.core.batch.object_poses[:, 0, :2])
        is_success = np.array([outcome == "success" for outcome in result.outcomes])
        is_drop = np.array([outcome in ("drop", "unstable") for outcome in result.outcomes])
        is_drop |= (xy > LOST_M).any(axis=1) & ~is_success
        is_over = is_success | is_drop | np.array([outcome == "timeout" for outcome in result.outcomes])
        ended = self.tracker.is_over() | is_over
        if ended.any():
            slots = np.flatnonzero(ended)
            state = self._look()[0].rows(slots)
            self._remember(slots, self._transitions(slots, state, is_success[slots], is_drop[slots]), replay)
        chosen = torch.from_numpy(~self._is_random)
        self.tally.add(
            torch.from_numpy(np.asarray(result.reward.total)) * chosen,
            torch.from_numpy(is_over) & chosen,
            torch.from_numpy(is_success),
        )
        if is_over.any():
            self._begin(np.flatnonzero(is_over))
            self.pending.last[is_over] = NO_LATER
        self.pending.must_choose = ended

    def _transitions(
        self,
        slots: Slots,
        after: PushState[np.ndarray],
        is_success: Bool[np.ndarray, "slot"],
        is_drop: Bool[np.ndarray, "slot"],
    ) -> Transitions:
        return Transitions(
            before=self.pending.state.rows(slots),
            after=after,
            goals=self._episodes.core.goals[slots],
            pushes=self.pending.pushes[slots],
            steps=self._episodes.core.steps[slots] - self.pending.steps[slots],
            is_success=is_success,
            is_drop=is_drop,
            targets=self._targets[slots],
            later=np.full(len(slots), NO_LATER),
            weights=np.ones(len(slots)),
        )

    def _remember(self, slots: Slots, transitions: Transitions, replay: Replay) -> None:
        numbers = replay.count + np.arange(len(slots))
        replay.add(transitions.to_rows())
        before = self.pending.last[slots]
        has_before = (before != NO_LATER) & (before >= replay.oldest)
        replay.put("later", before[has_before], numbers[has_before])
        self.pending.last[slots] = numbers

    def _begin(self, slots: Slots) -> None:
        self._episodes.begin(slots)
        self._read_facts(slots)

    def _read_facts(self, slots: Slots) -> None:
        models = [self._streams.tasks[slot].model for slot in slots]
        self._facts.put(slots, SceneFacts.of(models))
        self._targets[slots] = self._shapes.rows_of([model.assets[0] for model in models])

    def _look(self) -> tuple[PushState[np.ndarray], HandKinematics[np.ndarray]]:
        batch = self._episodes.core.batch
        bodies = BodyState(
            arm_qpos=batch.arm_qpos,
            arm_qvel=batch.arm_qvel,
            object_poses=batch.object_poses,
            object_velocities=batch.object_velocities,
        )
        hand = hand_kinematics(batch.arm_qpos)
        return read_push_state(bodies, hand, self._facts), hand
