"""A world model on transitions: its loss, and its prediction errors beside the floors."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import torch
from jaxtyping import Float
from pydantic import Field
from torch import Tensor

from clutter6d.schema import FileModel
from dapl_baselines.interactions.dataset import InteractionData, Transitions
from dapl_baselines.world_model.batches import Batch, in_order
from dapl_baselines.world_model.loss import Loss, LossConfig, world_model_loss
from dapl_baselines.world_model.metrics import (
    FLOORS,
    POINT_SETS,
    CloudErrors,
    Floor,
    PointSet,
    floor_positions,
    prediction_errors,
)
from dapl_baselines.world_model.model import WorldModel
from dapl_baselines.world_model.prediction import Prediction

EVALUATION_ROWS: Final = 64
"""Rows of a batch: one term of the loss compares variances over a batch, so it depends on its size."""
Predictor = Literal["model"] | Floor
PREDICTORS: Final[tuple[Predictor, ...]] = ("model", *FLOORS)


class MeanErrors(FileModel):
    """Mean errors over clouds.

    Attributes:
        clouds: Clouds that have points of the set.
        chamfer_cm: Chamfer distance, the paper's P.E.; 0 without clouds.
        distance_cm: Distance of each point to itself; 0 without clouds.
    """

    clouds: int = Field(ge=0)
    chamfer_cm: float
    distance_cm: float


ErrorTable = dict[PointSet, dict[Predictor, MeanErrors]]
"""Errors by set of points and by what predicts them."""


def batch_loss(model: WorldModel, batch: Batch, config: LossConfig) -> tuple[Prediction, Loss]:
    """What the model makes of a batch, and its loss."""
    prediction = model(batch.now, batch.flow)
    later = batch.later
    return prediction, world_model_loss(prediction, batch.now, later[..., :3], later[..., 4:], model.config, config)


@dataclass(frozen=True, kw_only=True, slots=True)
class Evaluation:
    """How a model does on transitions.

    Attributes:
        loss: Mean loss over batches.
        dynamics_loss: The same without the term that compares variances (paper: L_dyn). A batch has one such term, and
            a single fast object decides on it, so it is too noisy to choose a model by.
        errors: Mean errors over clouds.
    """

    loss: float
    dynamics_loss: float
    errors: ErrorTable


@torch.inference_mode()
def evaluate(
    model: WorldModel,
    data: InteractionData,
    transitions: Transitions,
    *,
    loss: LossConfig,
    sets: Sequence[PointSet] = POINT_SETS,
    predictors: Sequence[Predictor] = PREDICTORS,
    show: Callable[[int], None] | None = None,
) -> Evaluation:
    """The model in evaluation mode, and the floors, on transitions.

    Args:
        model: The model.
        data: Where the transitions are.
        transitions: Which.
        loss: Weights and form of the loss.
        sets: Sets of points that errors are wanted of.
        predictors: What errors are wanted of.
        show: Told how many transitions are done.
    """
    was_training, device = model.training, next(model.parameters()).device
    model.eval()
    found: dict[tuple[PointSet, Predictor], list[CloudErrors]] = defaultdict(list)
    total, variance, done = 0.0, 0.0, 0
    for batch in in_order(data, transitions, EVALUATION_ROWS):
        prediction, found_loss = batch_loss(model, batch.to(device), loss)
        positions = {"model": prediction.positions.float().cpu(), **floor_positions(batch.now)}
        for predictor in predictors:
            for name, errors in _errors(positions[predictor], batch, sets).items():
                found[name, predictor].append(errors)
        total += float(found_loss.total) * len(batch.now)
        variance += float(found_loss.terms.get("variance", 0.0)) * len(batch.now)
        done += len(batch.now)
        if show is not None:
            show(done)
    model.train(was_training)
    table: ErrorTable = {}
    for name in sets:
        table[name] = {predictor: _mean(found[name, predictor]) for predictor in predictors}
    mean, spread = total / max(done, 1), loss.variance_weight * variance / max(done, 1)
    return Evaluation(loss=mean, dynamics_loss=mean - spread, errors=table)


def _errors(
    positions: Float[Tensor, "row 1280 3"], batch: Batch, sets: Sequence[PointSet]
) -> Mapping[PointSet, CloudErrors]:
    return prediction_errors(positions, batch.now[..., :3], batch.later[..., :3], sets)


def _mean(parts: Sequence[CloudErrors]) -> MeanErrors:
    chamfer, distance = (torch.cat([getattr(part, name) for part in parts]) for name in ("chamfer_cm", "distance_cm"))
    return MeanErrors(
        clouds=len(chamfer),
        chamfer_cm=float(chamfer.double().mean()) if len(chamfer) else 0.0,
        distance_cm=float(distance.double().mean()) if len(distance) else 0.0,
    )
