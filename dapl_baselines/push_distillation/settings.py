"""The settings of a student of pushes, and the presets."""

from typing import Final, Literal

from pydantic import Field, model_validator

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import MAX_CONTROL_STEPS, TerminationConfig
from clutter6d.schema import FileModel
from dapl_baselines.checkpoint import Precision
from dapl_baselines.push_policy.candidates import Counts
from dapl_baselines.push_policy.student import PushStudentConfig


class PushDistillationSettings(FileModel):
    """A distillation of pushes.

    Attributes:
        schema_version: Of these fields.
        student: The network; its encoder is that of what the user names.
        slots: Episodes that run at once.
        random_share: Share of pushes that are drawn at random.
        teacher_iterations: Iterations in which the share of slots where the teacher chooses falls from all to none.
        segments: Segments that a decision in training is made among, and judged for the student.
        whole_pushes: Whole pushes of the same.
        steps: Control steps of all slots in an iteration.
        updates: Steps of the optimiser in an iteration.
        batch: States of a step of the optimiser.
        iterations: Iterations in all.
        warm_up: States before the first step of the optimiser.
        kept: States that are kept; the newest take the place of the oldest.
        learning_rate: AdamW's, at first.
        final_learning_rate: AdamW's at the end; it falls in a straight line, and stays.
        falling_updates: Steps of the optimiser in which it falls.
        weight_decay: AdamW's.
        max_grad_norm: Bound on the gradient's norm.
        huber: Where the losses of values turn from squares to straight lines.
        rank_weight: Weight of the loss of which pushes are better than which.
        temperature: Difference of value at which a push is e times as likely, in that loss.
        seed: Of everything drawn.
        max_steps: Control steps of an episode at most.
        save_every: Iterations between two states on disk; what a kill costs at most.
        evaluate_every: Iterations between looks at the validation scenes.
        stored_precision: Of the weights in the checkpoints, which are what is looked at.
    """

    schema_version: Literal[1] = 1
    student: PushStudentConfig = PushStudentConfig()
    slots: int = Field(default=64, ge=1, le=1 << 16)
    random_share: float = Field(default=0.1, ge=0, le=1)
    teacher_iterations: int = Field(default=100, ge=0)
    segments: int = Field(default=8, ge=1, le=4096)
    whole_pushes: int = Field(default=24, ge=1, le=4096)
    steps: int = Field(default=20, ge=1, le=4096)
    updates: int = Field(default=20, ge=1, le=100_000)
    batch: int = Field(default=64, ge=1, le=1 << 16)
    iterations: int = Field(default=750, ge=1)
    warm_up: int = Field(default=1_000, ge=1)
    kept: int = Field(default=60_000, ge=100, le=16_000_000)
    learning_rate: float = Field(default=1e-3, gt=0, le=1)
    final_learning_rate: float = Field(default=1e-4, gt=0, le=1)
    falling_updates: int = Field(default=15_000, ge=1)
    weight_decay: float = Field(default=1e-2, ge=0, le=1)
    max_grad_norm: float = Field(default=1.0, gt=0)
    huber: float = Field(default=0.3, gt=0)
    rank_weight: float = Field(default=0.1, ge=0)
    temperature: float = Field(default=0.1, gt=0)
    seed: int = Field(default=0, ge=0)
    max_steps: int = Field(default=MAX_CONTROL_STEPS, ge=1)
    save_every: int = Field(default=10, ge=1)
    evaluate_every: int = Field(default=150, ge=1)
    stored_precision: Precision = "float16"

    @model_validator(mode="after")
    def _check(self) -> "PushDistillationSettings":
        if self.kept < 2 * self.lessons_at_risk:
            raise ValueError(f"kept: {self.kept} is less than twice slots * steps * save_every, {self.lessons_at_risk}")
        return self

    @property
    def lessons_at_risk(self) -> int:
        """Lessons that may be added between two states on disk, at most: one a slot in each control step."""
        return self.slots * self.steps * self.save_every

    @property
    def counts(self) -> Counts:
        """The pushes that a decision in training is made among."""
        return Counts(segments=self.segments, whole=self.whole_pushes)

    def env(self) -> EnvConfig:
        """The environment's configuration."""
        return EnvConfig(termination=TerminationConfig(max_steps=self.max_steps))

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
