"""The settings of a pretraining on contacts, and the presets."""

import math
from typing import Annotated, Final, Literal

from pydantic import Field, model_validator

from clutter6d.schema import FileModel
from dapl_baselines.checkpoint import Precision
from dapl_baselines.contact_pretraining.contact_model import ContactModelConfig

Metres = Annotated[float, Field(ge=0, le=2)]


class ExampleSettings(FileModel):
    """How hands and objects are drawn; numbers as CORN's public configuration has them, but for ``place_m``.

    Attributes:
        schema_version: Of these fields.
        radius_m: Bounds of the objects' size: the distance of their farthest point from the middle.
        place_m: How far objects are moved at most along the world's axes; CORN: 0.1 m, on a smaller table.
        gap_mean_m: How far from the object's surface the hand's is, at the mean.
        gap_std_m: Standard deviation of that; where it is negative, the hand is pushed into the object.
        noise_m: Standard deviation of the errors of what is seen; CORN: 0.01, of clouds divided by 0.4 m.
    """

    schema_version: Literal[1] = 1
    radius_m: tuple[Metres, Metres] = (0.04, 0.12)
    place_m: tuple[Metres, Metres, Metres] = (0.35, 0.5, 0.1)
    gap_mean_m: float = Field(default=0.03, ge=-1, le=1)
    gap_std_m: Metres = 0.05
    noise_m: Metres = 0.004

    @model_validator(mode="after")
    def _sizes_are_ordered(self) -> "ExampleSettings":
        if not 0 < self.radius_m[0] <= self.radius_m[1]:
            raise ValueError(f"radius_m: {self.radius_m} are not two sizes, the smaller one first")
        return self


class ContactSettings(FileModel):
    """A pretraining; optimiser and schedule are CORN's, its batch of 1,024 is smaller here.

    Attributes:
        schema_version: Of these fields.
        model: What is trained.
        examples: How hands and objects are drawn.
        steps: Steps of the optimiser.
        batch: Examples of a step.
        learning_rate: AdamW's, after the warm-up.
        final_learning_rate: AdamW's at the end, where a cosine takes it.
        warmup_steps: Steps in which it rises from zero.
        weight_decay: AdamW's.
        max_grad_norm: Bound on the gradient's norm.
        save_every: Steps that a row of the loss curve is the mean of, and between two states on disk.
        evaluate_every: Steps between looks at the objects that are held out.
        watched: Examples that are looked at.
        seed: Of everything drawn.
        stored_precision: Of the weights in the checkpoint.
    """

    schema_version: Literal[1] = 1
    model: ContactModelConfig = Field(default_factory=ContactModelConfig)
    examples: ExampleSettings = Field(default_factory=ExampleSettings)
    steps: int = Field(default=6_000, ge=1)
    batch: int = Field(default=256, ge=1, le=65_536)
    learning_rate: float = Field(default=2e-4, gt=0, le=1)
    final_learning_rate: float = Field(default=1e-6, gt=0, le=1)
    warmup_steps: int = Field(default=200, ge=1)
    weight_decay: float = Field(default=5e-4, ge=0)
    max_grad_norm: float = Field(default=1.0, gt=0)
    save_every: int = Field(default=50, ge=1)
    evaluate_every: int = Field(default=500, ge=1)
    watched: int = Field(default=4_096, ge=1, le=65_536)
    seed: int = Field(default=0, ge=0)
    stored_precision: Precision = "float16"

    @model_validator(mode="after")
    def _looks_are_saved(self) -> "ContactSettings":
        if self.evaluate_every % self.save_every:
            raise ValueError(
                f"evaluate_every: {self.evaluate_every} is not a multiple of save_every, {self.save_every}"
            )
        return self

    def learning_rate_at(self, step: int) -> float:
        """The learning rate of a step, after so many."""
        warm = min(1.0, (step + 1) / self.warmup_steps)
        fall = (1 + math.cos(math.pi * step / self.steps)) / 2
        return warm * (self.final_learning_rate + fall * (self.learning_rate - self.final_learning_rate))


PRESETS: Final = {
    "laptop": ContactSettings(),
    "paper": ContactSettings(batch=1_024, steps=20_000),
    "small": ContactSettings(steps=40, batch=32, warmup_steps=10, save_every=5, evaluate_every=20, watched=256),
}
"""``laptop``: half an hour on two cores. ``paper``: CORN's batch. ``small``: seconds, to see that everything works."""
