"""What came of a round, and the table of all rounds."""

import csv
import io
from collections.abc import Sequence
from math import nan
from typing import Literal

from pydantic import Field

from clutter6d.schema import FileModel
from dapl_baselines.validation_run import ValidationResult
from dapl_baselines.world_model.evaluation import MeanErrors, Predictor


class RoundResult(FileModel):
    """``round.json``: a round that is over.

    Attributes:
        schema_version: Of these fields.
        round: Its number, from 1.
        recorded_steps: Control steps of all interactions so far.
        errors: On moving points of objects in held-out scenes, of the world model and of both floors.
        validation: What became of the validation episodes.
        world_model_minutes: Time that the world model took.
        policy_minutes: Time that rollouts and updates of the policy took.
    """

    schema_version: Literal[1] = 1
    round: int = Field(ge=1)
    recorded_steps: int = Field(ge=1)
    errors: dict[Predictor, MeanErrors]
    validation: ValidationResult
    world_model_minutes: float = Field(ge=0)
    policy_minutes: float = Field(ge=0)

    def error_cm(self, predictor: Predictor) -> float:
        """P.E. on moving points of objects; NaN if none were seen to move."""
        found = self.errors[predictor]
        return found.chamfer_cm if found.clouds else nan

    def row(self) -> dict[str, float]:
        """Its row in ``curriculum.csv``; columns that begin with ``timing_`` are the only ones that may differ."""
        return {
            "round": self.round,
            "recorded_steps": self.recorded_steps,
            "world_model_error_cm": self.error_cm("model"),
            "copy_error_cm": self.error_cm("copy"),
            "constant_velocity_error_cm": self.error_cm("constant_velocity"),
            "moving_clouds": self.errors["model"].clouds,
            "episodes": self.validation.episodes,
            "success_rate": self.validation.success_rate,
            "mean_offset_cm": self.validation.mean_offset_cm,
            "timing_world_model_minutes": self.world_model_minutes,
            "timing_policy_minutes": self.policy_minutes,
        }

    def describe(self) -> str:
        """One line on it."""
        return (
            f"round {self.round}: {self.validation.success_rate:.1%} of {self.validation.episodes} validation episodes "
            f"succeed, other objects are moved by {self.validation.mean_offset_cm:.2f} cm; world model after "
            f"{self.recorded_steps:,} steps: P.E. {self.error_cm('model'):.3f} cm (copy {self.error_cm('copy'):.3f}, "
            f"constant velocity {self.error_cm('constant_velocity'):.3f})"
        )


def to_csv(results: Sequence[RoundResult]) -> bytes:
    """The table, one row a round."""
    rows, text = [result.row() for result in results], io.StringIO()
    table = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue().encode()
