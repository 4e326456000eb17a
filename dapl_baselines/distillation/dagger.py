"""DAgger (Ross, Gordon and Bagnell 2011): the student acts, the teacher says what it would have done there."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float16, Int
from torch import Tensor

from clutter6d.seeding import generator
from dapl_baselines.distillation.settings import DistillationSettings
from dapl_baselines.distillation.student import DistillationLosses, Student
from dapl_baselines.distillation.student_env import StudentEnv, StudentView
from dapl_baselines.distillation.teacher import Labels, Teacher
from dapl_baselines.distillation.windows import take_windows
from dapl_baselines.replay import Replay


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Dagger:
    """Everything that an iteration needs.

    Attributes:
        settings: Of the distillation.
        env: The environments.
        teacher: Labels every state.
        student: Acts in most, and learns.
        replay: What it learns from.
    """

    settings: DistillationSettings
    env: StudentEnv
    teacher: Teacher
    student: Student
    replay: Replay

    def iterate(self, iteration: int) -> DistillationLosses:
        """One rollout, and the updates after it; returns the mean losses.

        Args:
            iteration: Iterations made before, which names what is drawn at random.
        """
        teacher_acts = self._teacher_acts(iteration)
        for _ in range(self.settings.steps_per_env):
            self._step(teacher_acts)
        return self._learn(iteration)

    def _step(self, teacher_acts: Bool[Tensor, "env"]) -> None:
        view, labels = self.env.student_view(), self.teacher.label(self.env.teacher_input())
        self.replay.add(make_rows(view, self.student.to_stored(view.state, view.cloud), labels, self.settings))
        # What the student remembers is in the replay, so that it need not be kept when a training is stopped.
        own = self.student.act(self._windows(np.arange(self.replay.count - self.settings.envs, self.replay.count)))
        self.student.update_statistics(view.state)
        self.env.step(torch.where(teacher_acts[:, None], labels.actions, own))

    def _learn(self, iteration: int) -> DistillationLosses:
        rng = generator(self.settings.seed, "distillation batches", iteration)
        shape = self.settings.updates, self.settings.batch_rows
        oldest = max(0, self.replay.count - self.settings.kept_rows)
        drawn = rng.integers(oldest, self.replay.count, size=shape)
        losses = [self.student.learn(self._windows(numbers)) for numbers in drawn]
        action, latent = torch.stack(losses).mean(dim=0).tolist()
        return DistillationLosses(action=action, latent=latent)

    def _windows(self, numbers: Int[np.ndarray, "row"]) -> dict[str, Tensor]:
        return take_windows(self.replay, numbers, envs=self.settings.envs, history=self.settings.network.history)

    def _teacher_acts(self, iteration: int) -> Bool[Tensor, "env"]:
        """In which environments the teacher acts, by lot."""
        envs = self.settings.envs
        lot = generator(self.settings.seed, "teacher acts", iteration).permutation(envs)
        return torch.from_numpy(np.less(lot, round(envs * self.settings.teacher_share(iteration))))


def make_rows(
    view: StudentView, stored: Float16[Tensor, "env ..."], labels: Labels, settings: DistillationSettings
) -> dict[str, Tensor]:
    """The rows that the replay keeps of a step: what the student saw, and what the teacher said."""
    seen = {"state": view.state, "stored": stored, "age": view.ages}
    return seen | labels.fields(settings.network.action_scale_rad)
