"""The report of a world model: its prediction errors beside the floors, as JSON and as a page."""

from collections.abc import Mapping
from typing import Final, Literal

from pydantic import Field

from clutter6d.schema import FileModel
from dapl_baselines.interactions.dataset import InteractionData
from dapl_baselines.world_model.evaluation import PREDICTORS, ErrorTable, Predictor
from dapl_baselines.world_model.metrics import FLOORS, PointSet
from dapl_baselines.world_model.train_config import RunConfig

_SET_NAMES: Final[Mapping[PointSet, str]] = {
    "all": "all points",
    "objects": "the objects' points",
    "moving": "moving points",
    "moving_objects": "moving points of objects",
}
_PREDICTOR_NAMES: Final[Mapping[Predictor, str]] = {
    "model": "model",
    "copy": "copy the input",
    "constant_velocity": "constant velocity",
}


class DataSummary(FileModel):
    """What a world model was trained and evaluated on.

    Attributes:
        policies: Who acted.
        training: Transitions it could be trained on.
        validation: Transitions of scenes that were held out.
        moving_share: Share of all transitions in which an object moves.
        sha256: Names exactly this data.
    """

    policies: tuple[str, ...]
    training: int = Field(ge=0)
    validation: int = Field(ge=0)
    moving_share: float
    sha256: str

    @classmethod
    def of(cls, data: InteractionData) -> "DataSummary":
        """The summary of data."""
        moving = int(data.training.is_moving.sum()) + int(data.validation.is_moving.sum())
        return cls(
            policies=tuple(sorted({header.policy for header in data.headers})),
            training=len(data.training),
            validation=len(data.validation),
            moving_share=moving / (len(data.training) + len(data.validation)),
            sha256=data.sha256,
        )


class Report(FileModel):
    """Everything that is said of a trained world model.

    Attributes:
        schema_version: Of these fields.
        config: What the training depended on.
        data: What it was trained on.
        parameters: Trained numbers.
        steps: Optimiser steps made.
        minutes: Time they took.
        best_step: Step of the checkpoint, the one with the lowest loss on held-out scenes.
        weights_sha256: Hash of its tensors.
        clutter6d: Version that evaluated it.
        held_out: Its errors, and the floors', on held-out scenes.
        trained_on: The same on scenes that it was trained on.
    """

    schema_version: Literal[1] = 1
    config: RunConfig
    data: DataSummary
    parameters: int
    steps: int
    minutes: float
    best_step: int
    weights_sha256: str
    clutter6d: str
    held_out: ErrorTable
    trained_on: ErrorTable


def share_under_floors(errors: ErrorTable, name: PointSet) -> float:
    """By which share the model's P.E. lies under the better floor's; negative if it lies above."""
    row = errors[name]
    floor = min(row[floor].chamfer_cm for floor in FLOORS)
    return 1 - row["model"].chamfer_cm / floor if floor > 0 else 0.0


def to_markdown(report: Report) -> str:
    """The report on a page."""
    data, train = report.data, report.config.train
    share = share_under_floors(report.held_out, "moving_objects")
    side = "under" if share >= 0 else "ABOVE"
    return "\n".join(
        [
            "# World model",
            "",
            f"{report.config.model.task}, {report.parameters:,} parameters; {report.steps:,} steps of "
            f"{train.batch.rows} transitions in {report.minutes:.1f} minutes, seed {train.seed}. The checkpoint is "
            f"that of step {report.best_step:,}.",
            "",
            f"Trained on {data.training:,} transitions of {', '.join(data.policies)}; {data.validation:,} more are of "
            f"scenes that were held out. In {data.moving_share:.0%} of all an object moves. Errors are means over some "
            "of either kind, drawn at random and always the same.",
            "",
            f"On moving points of objects in held-out scenes, P.E. is {abs(share):.0%} {side} the better floor.",
            "",
            "## Held-out scenes",
            "",
            *_table(report.held_out),
            "",
            "## Scenes it was trained on",
            "",
            *_table(report.trained_on),
            "",
            "P.E.: Chamfer distance between predicted and true points 0.1 s later, in cm, the mean over clouds that "
            "have such points. Distance: of each point to itself. Moving: displaced by more than 2 mm.",
            "",
            f"Data {data.sha256[:12]}, weights {report.weights_sha256[:12]}, clutter6d {report.clutter6d}.",
            "",
        ]
    )


def _table(errors: ErrorTable) -> list[str]:
    names = [_PREDICTOR_NAMES[predictor] for predictor in PREDICTORS]
    head = ["points", "clouds", *(f"P.E.: {name}" for name in names), *(f"distance: {name}" for name in names)]
    lines = [f"| {' | '.join(head)} |", f"|---|{'---:|' * (len(head) - 1)}"]
    for name, row in errors.items():
        cells = [_SET_NAMES[name], f"{row['model'].clouds:,}"]
        cells += [f"{row[predictor].chamfer_cm:.3f}" for predictor in PREDICTORS]
        cells += [f"{row[predictor].distance_cm:.3f}" for predictor in PREDICTORS]
        lines.append(f"| {' | '.join(cells)} |")
    return lines
