"""The settings of a curriculum, and the presets."""

from typing import Final, Literal

from pydantic import Field

from clutter6d.envs.termination import MAX_CONTROL_STEPS
from clutter6d.schema import FileModel
from clutter6d.seeding import seed_words
from dapl_baselines.policy.settings import PRESETS as POLICY_PRESETS
from dapl_baselines.policy.settings import TrainingSettings
from dapl_baselines.world_model.loss import LossConfig
from dapl_baselines.world_model.model import WorldModelConfig
from dapl_baselines.world_model.train_config import TRAIN_PRESETS, TrainConfig


class CurriculumSettings(FileModel):
    """What every round is made of (paper, "Curriculum Learning with Policy Interaction").

    The paper trains each policy until reward and success no longer rise; here every round has the same budget.

    Attributes:
        schema_version: Of these fields.
        rounds: Rounds in all. The paper's figure shows a first policy and three that follow.
        record_steps: Control steps recorded in a round, about (the paper's 60,000); later rounds learn from all.
        record_max_steps: Control steps of a recorded episode at most.
        random_share: Share of the first round's steps that are random residuals, which seldom touch anything.
        model: The world model.
        loss: What it is trained to make small.
        train: How it is trained in a round; its seed is the round's.
        policy: How the policy is trained in a round; its seed is the round's, its encoder the world model's.
        seed: Of everything drawn.
    """

    schema_version: Literal[1] = 1
    rounds: int = Field(default=4, ge=1, le=100)
    record_steps: int = Field(default=60_000, ge=1)
    record_max_steps: int = Field(default=MAX_CONTROL_STEPS, ge=2, le=1_000)
    random_share: float = Field(default=0.0, ge=0, le=1)
    model: WorldModelConfig = WorldModelConfig()
    loss: LossConfig = TRAIN_PRESETS["paper"].loss
    train: TrainConfig = TRAIN_PRESETS["paper"].train
    policy: TrainingSettings = POLICY_PRESETS["paper"]
    seed: int = Field(default=0, ge=0)

    def seed_of(self, number: int) -> int:
        """The seed of a round, so that none sees the episodes of another."""
        return seed_words(self.seed, "curriculum", number)[0]


PRESETS: Final = {
    "paper": CurriculumSettings(),
    "laptop": CurriculumSettings(
        rounds=3,
        record_max_steps=100,
        loss=TRAIN_PRESETS["laptop"].loss,
        train=TRAIN_PRESETS["laptop"].train,
        policy=POLICY_PRESETS["laptop"].model_copy(update={"iterations": 1_000}),
    ),
}
"""``paper``: for GPUs. ``laptop``: two cores; an hour a round for the world model, 2 million steps for the policy."""
