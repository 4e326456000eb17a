"""What the trainings of networks that judge pushes have in common."""

from typing import Annotated, Literal

import torch
from pydantic import Field, model_validator
from torch import Tensor, nn

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import MAX_CONTROL_STEPS, TerminationConfig
from clutter6d.schema import FileModel
from dapl_baselines.checkpoint import Precision

AtLeastOne = Annotated[int, Field(ge=1)]
Count = Annotated[int, Field(ge=1, le=1 << 16)]
Kept = Annotated[int, Field(ge=100, le=16_000_000)]
Rate = Annotated[float, Field(gt=0, le=1)]
Share = Annotated[float, Field(ge=0, le=1)]


class PushTrainingSettings(FileModel):
    """Practice in slots, and learning from rows of a replay beside it.

    Attributes:
        schema_version: Of these fields.
        slots: Episodes that run at once.
        random_share: Share of pushes that are drawn at random.
        steps: Control steps of all slots in an iteration.
        updates: Steps of the optimiser in an iteration.
        batch: Rows of a step of the optimiser.
        iterations: Iterations in all.
        warm_up: Rows before the first step of the optimiser.
        kept: Rows that are kept; the newest take the place of the oldest.
        learning_rate: AdamW's, at first.
        final_learning_rate: AdamW's at the end; it falls in a straight line, and stays.
        falling_updates: Steps of the optimiser in which it falls.
        weight_decay: AdamW's.
        max_grad_norm: Bound on the gradient's norm.
        huber: Where the losses of values turn from squares to straight lines.
        seed: Of everything drawn.
        max_steps: Control steps of an episode at most.
        save_every: Iterations between two states on disk; what a kill costs at most.
        evaluate_every: Iterations between looks at the validation scenes.
        stored_precision: Of the weights in the checkpoints, which are what is looked at.
    """

    schema_version: Literal[1] = 1
    slots: Count
    random_share: Share
    steps: Annotated[int, Field(ge=1, le=4096)] = 20
    updates: Annotated[int, Field(ge=1, le=100_000)]
    batch: Count
    iterations: AtLeastOne
    warm_up: AtLeastOne
    kept: Kept
    learning_rate: Rate = 1e-3
    final_learning_rate: Rate
    falling_updates: AtLeastOne
    weight_decay: Share = 1e-2
    max_grad_norm: Annotated[float, Field(gt=0)] = 1.0
    huber: Annotated[float, Field(gt=0)] = 0.3
    seed: Annotated[int, Field(ge=0)] = 0
    max_steps: AtLeastOne = MAX_CONTROL_STEPS
    save_every: AtLeastOne = 10
    evaluate_every: AtLeastOne
    stored_precision: Precision = "float16"

    @model_validator(mode="after")
    def _keeps_what_is_at_risk(self) -> "PushTrainingSettings":
        if self.kept < 2 * self.rows_at_risk:
            raise ValueError(f"kept: {self.kept} is less than twice slots * steps * save_every, {self.rows_at_risk}")
        return self

    @property
    def rows_at_risk(self) -> int:
        """Rows that may be added between two states on disk, at most: one a slot in each control step."""
        return self.slots * self.steps * self.save_every

    def learning_rate_at(self, update: int) -> float:
        """The learning rate of a step of the optimiser, after so many."""
        share = min(1.0, update / self.falling_updates)
        return self.learning_rate + share * (self.final_learning_rate - self.learning_rate)

    def env(self) -> EnvConfig:
        """The environment's configuration."""
        return EnvConfig(termination=TerminationConfig(max_steps=self.max_steps))


def descend(optimizer: torch.optim.Optimizer, loss: Tensor, settings: PushTrainingSettings, update: int) -> None:
    """One step of an optimiser with one group of weights, after so many."""
    (group,) = optimizer.param_groups
    group["lr"] = settings.learning_rate_at(update)
    optimizer.zero_grad()
    loss.backward()
    nn.utils.clip_grad_norm_(group["params"], settings.max_grad_norm)
    optimizer.step()
