"""The settings of a teacher's training, and the presets."""

from typing import Final, Literal

from pydantic import Field

from clutter6d.schema import FileModel
from dapl_baselines.push_policy.candidates import Counts
from dapl_baselines.push_policy.critic import PushCriticConfig
from dapl_baselines.push_policy.training_settings import AtLeastOne, Count, PushTrainingSettings, Rate, Share


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


class TeacherSettings(PushTrainingSettings):
    """A teacher's training; a row of its replay is a transition.

    Attributes:
        critic: The network.
        goals: Which goals it learns with.
        random_slots: Share of slots in which every push is drawn at random; ``random_share`` is that of the others.
        practice_segments: Segments that a decision in training is made among.
        practice_pushes: Whole pushes that it is made among.
        future_segments: Segments among which the best is sought where a push ends.
        future_pushes: Whole pushes among which it is.
        target_rate: Share in which the slow copy of the network follows, at each step of the optimiser.
        future_weight: Weight of the loss of what comes after a push.
        motion_weight: Weight of the loss of the target's motion, which teaches what pushes do.
    """

    critic: PushCriticConfig = PushCriticConfig()
    goals: GoalSettings = GoalSettings()
    slots: Count = 128
    random_slots: Share = 0.1
    random_share: Share = 0.15
    practice_segments: int = Field(default=8, ge=1, le=4096)
    practice_pushes: int = Field(default=24, ge=1, le=4096)
    future_segments: int = Field(default=2, ge=1, le=4096)
    future_pushes: int = Field(default=4, ge=1, le=4096)
    updates: int = Field(default=16, ge=1, le=100_000)
    batch: Count = 256
    iterations: AtLeastOne = 2_500
    warm_up: AtLeastOne = 20_000
    kept: int = Field(default=1_000_000, ge=1_000, le=16_000_000)
    target_rate: Rate = 0.01
    final_learning_rate: Rate = 1e-4
    falling_updates: AtLeastOne = 36_000
    future_weight: float = Field(default=0.5, ge=0)
    motion_weight: float = Field(default=1.5, ge=0)
    evaluate_every: AtLeastOne = 500

    @property
    def practice_counts(self) -> Counts:
        """The pushes that a decision in training is made among."""
        return Counts(segments=self.practice_segments, whole=self.practice_pushes)

    @property
    def future_counts(self) -> Counts:
        """The pushes among which the best is sought where a push ends."""
        return Counts(segments=self.future_segments, whole=self.future_pushes)


PRESETS: Final = {
    "laptop": TeacherSettings(),
    "small": TeacherSettings(
        slots=16, steps=8, updates=4, batch=64, iterations=20, warm_up=32, kept=1_000, save_every=2, evaluate_every=10
    ),
}
"""``laptop``: two cores. ``small``: minutes, to see that everything works; it learns next to nothing."""
