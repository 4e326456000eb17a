"""The settings of a teacher's training, and the presets."""

from typing import Final, Literal

from pydantic import Field, model_validator

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import MAX_CONTROL_STEPS, TerminationConfig
from clutter6d.schema import FileModel
from dapl_baselines.checkpoint import Precision
from dapl_baselines.push_policy.candidates import Counts
from dapl_baselines.push_policy.critic import PushCriticConfig


class GoalSettings(FileModel):
    """Which goals a transition is learned from with; the rest keep their own.

    Attributes:
        later_share: Share of transitions whose goal becomes a later pose of the same episode (Andrychowicz et al. 2017,
            hindsight), so that there are successes to learn from before there are any.
        later_hop: Probability with which "later" ends after each push; 1: the push's own outcome.
        moved_share: Share whose goal is turned about the vertical and moved at random.
        move_m: How far from the target at most.
    """

    schema_version: Literal[1] = 1
    later_share: float = Field(default=0.30, ge=0, le=1)
    later_hop: float = Field(default=0.12, gt=0, le=1)
    moved_share: float = Field(default=0.35, ge=0, le=1)
    move_m: float = Field(default=0.45, gt=0, le=2)


class TeacherSettings(FileModel):
    """A teacher's training.

    Attributes:
        schema_version: Of these fields.
        critic: The network.
        goals: Which goals it learns with.
        slots: Episodes that run at once.
        random_slots: Share of them in which every push is drawn at random.
        random_share: Share of random pushes in the others.
        practice_segments: Segments that a decision in training is made among.
        practice_pushes: Whole pushes that it is made among.
        future_segments: Segments among which the best is sought where a push ends.
        future_pushes: Whole pushes among which it is.
        steps: Control steps of all slots in an iteration.
        updates: Steps of the optimiser in an iteration.
        batch: Transitions of a step of the optimiser.
        iterations: Iterations in all.
        warm_up: Transitions before the first step of the optimiser.
        kept: Transitions that are kept; the newest take the place of the oldest.
        target_rate: Share in which the slow copy of the network follows, at each step of the optimiser.
        learning_rate: AdamW's, at first.
        final_learning_rate: AdamW's at the end; it falls in a straight line, and stays.
        falling_updates: Steps of the optimiser in which it falls.
        weight_decay: AdamW's.
        max_grad_norm: Bound on the gradient's norm.
        huber: Where the losses turn from squares to straight lines.
        future_weight: Weight of the loss of what comes after a push.
        motion_weight: Weight of the loss of the target's motion, which teaches what pushes do.
        seed: Of everything drawn.
        max_steps: Control steps of an episode at most.
        save_every: Iterations between two states on disk; what a kill costs at most.
        evaluate_every: Iterations between looks at the validation scenes.
        stored_precision: Of the weights in the checkpoints, which are what is looked at.
    """

    schema_version: Literal[1] = 1
    critic: PushCriticConfig = PushCriticConfig()
    goals: GoalSettings = GoalSettings()
    slots: int = Field(default=128, ge=1, le=1 << 16)
    random_slots: float = Field(default=0.1, ge=0, le=1)
    random_share: float = Field(default=0.15, ge=0, le=1)
    practice_segments: int = Field(default=8, ge=1, le=4096)
    practice_pushes: int = Field(default=24, ge=1, le=4096)
    future_segments: int = Field(default=2, ge=1, le=4096)
    future_pushes: int = Field(default=6, ge=1, le=4096)
    steps: int = Field(default=20, ge=1, le=4096)
    updates: int = Field(default=30, ge=1, le=100_000)
    batch: int = Field(default=256, ge=1, le=1 << 16)
    iterations: int = Field(default=5_000, ge=1)
    warm_up: int = Field(default=4_000, ge=1)
    kept: int = Field(default=1_000_000, ge=1_000, le=16_000_000)
    target_rate: float = Field(default=0.01, gt=0, le=1)
    learning_rate: float = Field(default=1e-3, gt=0, le=1)
    final_learning_rate: float = Field(default=2e-4, gt=0, le=1)
    falling_updates: int = Field(default=100_000, ge=1)
    weight_decay: float = Field(default=1e-2, ge=0, le=1)
    max_grad_norm: float = Field(default=1.0, gt=0)
    huber: float = Field(default=0.3, gt=0)
    future_weight: float = Field(default=0.5, ge=0)
    motion_weight: float = Field(default=1.5, ge=0)
    seed: int = Field(default=0, ge=0)
    max_steps: int = Field(default=MAX_CONTROL_STEPS, ge=1)
    save_every: int = Field(default=10, ge=1)
    evaluate_every: int = Field(default=250, ge=1)
    stored_precision: Precision = "float16"

    @model_validator(mode="after")
    def _check(self) -> "TeacherSettings":
        if self.kept < 2 * self.pushes_at_risk:
            raise ValueError(f"kept: {self.kept} is less than twice slots * steps * save_every, {self.pushes_at_risk}")
        return self

    @property
    def pushes_at_risk(self) -> int:
        """Pushes that may be over between two states on disk, at most: one a slot in each control step."""
        return self.slots * self.steps * self.save_every

    @property
    def practice_counts(self) -> Counts:
        """The pushes that a decision in training is made among."""
        return Counts(segments=self.practice_segments, whole=self.practice_pushes)

    @property
    def future_counts(self) -> Counts:
        """The pushes among which the best is sought where a push ends."""
        return Counts(segments=self.future_segments, whole=self.future_pushes)

    def env(self) -> EnvConfig:
        """The environment's configuration."""
        return EnvConfig(termination=TerminationConfig(max_steps=self.max_steps))


PRESETS: Final = {
    "laptop": TeacherSettings(),
    "small": TeacherSettings(
        slots=16, steps=8, updates=4, batch=64, iterations=20, warm_up=32, kept=1_000, save_every=2, evaluate_every=10
    ),
}
"""``laptop``: two cores. ``small``: minutes, to see that everything works; it learns next to nothing."""
