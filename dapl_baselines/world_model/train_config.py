"""Settings of a world model's training, as they stand in its folder and in its checkpoint."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from pydantic import Field, model_validator

from clutter6d.errors import UnknownNameError
from clutter6d.schema import FileModel
from dapl_baselines.checkpoint import Precision
from dapl_baselines.world_model.batches import BatchConfig
from dapl_baselines.world_model.loss import LossConfig
from dapl_baselines.world_model.model import WorldModelConfig


class TrainConfig(FileModel):
    """How a world model is trained; the paper gives 500,000 steps and nothing else.

    Attributes:
        schema_version: Of these fields.
        steps: Optimiser steps at most.
        minutes: Minutes at most, over all the times it is started; ``None``: no limit. The learning rate follows
            whichever limit is nearer.
        batch: How batches are drawn.
        learning_rate: Of AdamW, after the warm-up.
        warmup_steps: Steps in which the learning rate rises from zero; a tenth of all steps at most.
        schedule: ``cosine``: falls to zero at the end; ``constant``: stays.
        weight_decay: Of AdamW.
        max_gradient_norm: Gradients longer than this are cut to it.
        precision: Of matrix products in training; weights stay float32. On a CPU a step in bfloat16 takes a third
            longer than in float32, measured on one that has instructions for it; on a graphics card it pays.
        stored_precision: Of the weights in the checkpoint.
        log_every: Steps that a row of the loss curve is the mean of; what an interruption costs at most.
        save_every: Steps between two states on disk; what a kill costs at most.
        validate_every: Steps between two looks at the scenes that are held out.
        validation_clouds: Transitions that are looked at.
        patience: Looks without improvement after which the training ends.
        seed: Of initial weights and batches.
    """

    schema_version: Literal[1] = 1
    steps: int = Field(default=500_000, ge=1)
    minutes: float | None = Field(default=None, gt=0)
    batch: BatchConfig = Field(default_factory=BatchConfig)
    learning_rate: float = Field(default=3e-4, gt=0)
    warmup_steps: int = Field(default=500, ge=0)
    schedule: Literal["cosine", "constant"] = "cosine"
    weight_decay: float = Field(default=0.01, ge=0)
    max_gradient_norm: float = Field(default=1.0, gt=0)
    precision: Literal["bfloat16", "float32"] = "float32"
    stored_precision: Precision = "float32"
    log_every: int = Field(default=10, ge=1)
    save_every: int = Field(default=100, ge=1)
    validate_every: int = Field(default=500, ge=1)
    validation_clouds: int = Field(default=1024, ge=1)
    patience: int = Field(default=20, ge=1)
    seed: int = 0

    @model_validator(mode="after")
    def _rows_of_curves_are_whole_when_it_is_saved(self) -> "TrainConfig":
        if self.save_every % self.log_every or self.validate_every % self.save_every:
            raise ValueError("save_every must be a multiple of log_every, and validate_every of save_every")
        return self

    def progress(self, step: int, seconds: float) -> float:
        """How much of the training is done, in [0, 1]."""
        shares = [step / self.steps, seconds / (60 * self.minutes) if self.minutes else 0.0]
        return min(1.0, max(shares))

    def learning_rate_at(self, step: int, seconds: float) -> float:
        """The learning rate of a step that begins so many seconds after the training did."""
        warm = min(1.0, (step + 1) / max(1, min(self.warmup_steps, self.steps // 10)))
        if self.schedule == "constant":
            return warm * self.learning_rate
        return warm * self.learning_rate * (1 + math.cos(math.pi * self.progress(step, seconds))) / 2


class RunConfig(FileModel):
    """Everything that a training's result depends on.

    Attributes:
        schema_version: Of these fields.
        model: What is trained.
        loss: What it is trained to make small.
        train: How.
        data_sha256: Names the interactions it is trained on.
        start_sha256: Weights that it begins with; empty: random ones.
    """

    schema_version: Literal[1] = 1
    model: WorldModelConfig
    loss: LossConfig = Field(default_factory=LossConfig)
    train: TrainConfig
    data_sha256: str = Field(pattern="^[0-9a-f]{64}$")
    start_sha256: str = Field(default="", pattern="^([0-9a-f]{64})?$")


@dataclass(frozen=True, kw_only=True, slots=True)
class TrainPreset:
    """Settings by name.

    Attributes:
        train: How a world model is trained.
        loss: What it is trained to make small.
    """

    train: TrainConfig
    loss: LossConfig


TRAIN_PRESETS: Final[Mapping[str, TrainPreset]] = {
    "laptop": TrainPreset(
        train=TrainConfig(minutes=60.0, batch=BatchConfig(rows=32), stored_precision="float16"),
        loss=LossConfig(variance_weight=1.0),
    ),
    "paper": TrainPreset(
        train=TrainConfig(
            batch=BatchConfig(rows=256, moving_share=0.5, is_turned=False),
            schedule="constant",
            precision="bfloat16",
            save_every=1_000,
            validate_every=5_000,
        ),
        loss=LossConfig(),
    ),
}
"""``laptop``: an hour on two cores without a graphics card. The variance of velocities in 32 transitions hangs on a few
fast points; with the paper's weight of 100 a small model did not even learn 64 transitions by heart in 260 steps of 16,
with a weight of 1 it did (position term 1.9 and 0.2 from 2.2). ``paper``: the paper's weights and number of steps.
"""


def find_train_preset(name: str) -> TrainPreset:
    """The settings of a name.

    Raises:
        UnknownNameError: There are none.
    """
    if name not in TRAIN_PRESETS:
        raise UnknownNameError("training preset", name, TRAIN_PRESETS)
    return TRAIN_PRESETS[name]
