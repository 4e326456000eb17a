"""Episodes in which a student practises, and a teacher says what it thinks of the pushes that the student looks at."""

import numpy as np
import torch
from jaxtyping import Bool
from torch import Tensor

from clutter6d.envs.slots import Slots
from clutter6d.seeding import generator
from dapl_baselines.policy.observation import cloud, hand_state
from dapl_baselines.push_distillation.lessons import Lessons, ask_teacher
from dapl_baselines.push_distillation.settings import PushDistillationSettings
from dapl_baselines.push_policy.candidates import draw_candidates
from dapl_baselines.push_policy.choice import choose
from dapl_baselines.push_policy.critic import PushCritic
from dapl_baselines.push_policy.push_slots import PushSlots
from dapl_baselines.push_policy.seen import Seen, see_points
from dapl_baselines.push_policy.student import PushStudent
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.replay import Replay
from dapl_baselines.validation import SceneSubset


class StudentPractice:
    """Slots in which the student chooses, or the teacher, or chance; DAgger (Ross, Gordon and Bagnell 2011).

    Args:
        scenes: What is trained on.
        shapes: Shapes of all their targets, which the teacher alone knows.
        settings: Of the distillation.
        teacher: A privileged critic.
        threads: Threads of the simulation; 0 for all cores.

    Attributes:
        slots: The episodes.
        must_choose: Where a push must be chosen.
    """

    def __init__(
        self,
        scenes: SceneSubset,
        shapes: TargetShapes,
        settings: PushDistillationSettings,
        teacher: PushCritic,
        *,
        threads: int = 0,
    ) -> None:
        self._settings, self._teacher, size = settings, teacher, settings.slots
        self.slots = PushSlots(scenes, shapes, settings.env(), size=size, seed=settings.seed, threads=threads)
        self.must_choose = np.ones(size, dtype=bool)

    def blank_rows(self, student: PushStudent) -> dict[str, Tensor]:
        """Rows of the replay that say nothing, for their sizes."""
        return self._lessons(np.arange(1), self.slots.see(), student, generator(0, "blank")).to_rows()

    def run(self, student: PushStudent, teacher_share: float, replay: Replay, rng: np.random.Generator) -> None:
        """The control steps of one iteration.

        Args:
            student: As it was before the iteration.
            teacher_share: In which share of slots the teacher chooses.
            replay: Where lessons go.
            rng: Where pushes are drawn from.
        """
        is_taught = rng.random(len(self.must_choose)) < teacher_share
        for _ in range(self._settings.steps):
            known, choosing = self.slots.see(), np.flatnonzero(self.must_choose)
            if len(choosing):
                self._choose(choosing, known, student, is_taught[choosing], replay, rng)
            ends = self.slots.step(known, np.ones(len(self.must_choose), dtype=bool))
            if ends.is_over.any():
                self.slots.begin(np.flatnonzero(ends.is_over))
            self.must_choose = ends.push

    def _choose(
        self,
        slots: Slots,
        known: Seen,
        student: PushStudent,
        is_taught: Bool[np.ndarray, "choosing"],
        replay: Replay,
        rng: np.random.Generator,
    ) -> None:
        lessons = self._lessons(slots, known, student, rng)
        replay.add(lessons.to_rows())
        with torch.no_grad():
            own = student(lessons.view(), lessons.tokens).value
        values = torch.where(torch.from_numpy(is_taught)[:, None], lessons.gain + lessons.future, own).numpy()
        drawn, origins = (array.double().numpy() for array in (lessons.pushes, lessons.state.poses[:, :3]))
        tracker, around = self.slots.tracker, known.rows(slots).points_in_the_way()
        best = choose(values, drawn, lambda pushes: tracker.may_begin(slots, pushes, origins, around))
        is_random = rng.random(len(slots)) < self._settings.random_share
        chosen = np.where(is_random, rng.integers(values.shape[1], size=len(slots)), best)
        tracker.begin(slots, drawn[np.arange(len(slots)), chosen], origins)

    def _lessons(self, slots: Slots, known: Seen, student: PushStudent, rng: np.random.Generator) -> Lessons:
        """What the student sees in slots, pushes for it, and the teacher's judgement."""
        observation = self.slots.observe(slots)
        seen = see_points(observation)
        drawn = draw_candidates(seen.state, seen.goals, seen.shapes, seen.targets, self._settings.counts, rng)
        tokens = student.encode(cloud(observation), hand_state(observation))
        return Lessons.of(seen, drawn, tokens, ask_teacher(self._teacher, known.rows(slots), seen, drawn))
