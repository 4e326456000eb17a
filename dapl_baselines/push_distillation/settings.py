"""The settings of a student of pushes, and the presets."""

from typing import Final

from pydantic import Field

from dapl_baselines.push_policy.candidates import Counts
from dapl_baselines.push_policy.student import PushStudentConfig
from dapl_baselines.push_policy.training_settings import AtLeastOne, Count, Kept, PushTrainingSettings, Rate, Share


class PushDistillationSettings(PushTrainingSettings):
    """A distillation of pushes; a row of its replay is a lesson: a state, and what the teacher thinks of pushes there.

    Attributes:
        student: The network; its encoder is that of what the user names.
        teacher_iterations: Iterations in which the share of slots where the teacher chooses falls from all to none.
        segments: Segments that a decision in training is made among, and judged for the student.
        whole_pushes: Whole pushes of the same.
        rank_weight: Weight of the loss of which pushes are better than which.
        temperature: Difference of value at which a push is e times as likely, in that loss.
    """

    student: PushStudentConfig = PushStudentConfig()
    slots: Count = 64
    random_share: Share = 0.1
    teacher_iterations: int = Field(default=100, ge=0)
    segments: int = Field(default=8, ge=1, le=4096)
    whole_pushes: int = Field(default=24, ge=1, le=4096)
    updates: int = Field(default=20, ge=1, le=100_000)
    batch: Count = 64
    iterations: AtLeastOne = 750
    warm_up: AtLeastOne = 1_000
    kept: Kept = 60_000
    final_learning_rate: Rate = 1e-4
    falling_updates: AtLeastOne = 15_000
    rank_weight: float = Field(default=0.1, ge=0)
    temperature: float = Field(default=0.1, gt=0)
    evaluate_every: AtLeastOne = 150

    @property
    def counts(self) -> Counts:
        """The pushes that a decision in training is made among."""
        return Counts(segments=self.segments, whole=self.whole_pushes)

    def teacher_share(self, iteration: int) -> float:
        """In which share of slots the teacher chooses."""
        return max(0.0, 1.0 - iteration / self.teacher_iterations) if self.teacher_iterations else 0.0


PRESETS: Final = {
    "laptop": PushDistillationSettings(),
    "small": PushDistillationSettings(
        slots=8, steps=8, updates=2, batch=8, iterations=10, warm_up=8, kept=300, save_every=2, evaluate_every=5
    ),
}
"""``laptop``: two cores. ``small``: minutes, to see that everything works; it learns next to nothing."""
