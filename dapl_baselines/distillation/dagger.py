"""DAgger (Ross, Gordon and Bagnell 2011): the student acts, the teacher says what it would have done there."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float16, Float32
from torch import Tensor

from clutter6d.seeding import generator
from dapl_baselines.distillation.replay import Replay
from dapl_baselines.distillation.settings import DistillationSettings
from dapl_baselines.distillation.student import DistillationLosses, Student
from dapl_baselines.distillation.student_env import StudentEnv
from dapl_baselines.distillation.teacher import Labels, Teacher


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
        stored = self.student.to_stored(view.cloud)
        own = self.student.act(view.state, stored)
        self.student.update_statistics(view.state)
        self.replay.add(make_rows(view.state, stored, labels, self.settings))
        self.env.step(torch.where(teacher_acts[:, None], labels.actions, own))

    def _learn(self, iteration: int) -> DistillationLosses:
        rng = generator(self.settings.seed, "distillation batches", iteration)
        shape = self.settings.updates, self.settings.batch_rows
        losses = [self.student.learn(self.replay.take(rows)) for rows in rng.integers(len(self.replay), size=shape)]
        action, latent = torch.stack(losses).mean(dim=0).tolist()
        return DistillationLosses(action=action, latent=latent)

    def _teacher_acts(self, iteration: int) -> Bool[Tensor, "env"]:
        """In which environments the teacher acts, by lot."""
        envs = self.settings.envs
        lot = generator(self.settings.seed, "teacher acts", iteration).permutation(envs)
        return torch.from_numpy(np.less(lot, round(envs * self.settings.teacher_share(iteration))))


def make_rows(
    state: Float32[Tensor, "env state"],
    stored: Float16[Tensor, "env ..."],
    labels: Labels,
    settings: DistillationSettings,
) -> dict[str, Tensor]:
    """The rows that the replay keeps of a step: what the student saw, and what the teacher said."""
    return {"state": state, "stored": stored, **labels.fields(settings.network.action_scale_rad)}
