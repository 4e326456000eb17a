"""What a world model is trained to make small (paper, appendix "Learning Objective").

The paper writes squared norms of whole arrays. Taken as sums, the position and velocity terms would grow with the batch
and with the number of points, and the variance term, which is one number for each axis, would not: the weights 1, 1 and
100 would mean something else for every batch size. So all terms here are *means* over rows and points, and *sums* over
the three axes: the mean squared length of the error vectors.

Errors are counted in centimetres, in tenths of a metre a second and in tenths of a radian
(:mod:`dapl_baselines.world_model.prediction`). In SI units, velocities that vary by 3 cm/s on each axis would make a
velocity term of 3e-3 at most and a variance term of 2e-6: even with a weight of 100 it would have no say.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, assert_never

import torch
from jaxtyping import Float
from pydantic import Field
from torch import Tensor

from clutter6d.schema import FileModel
from dapl_baselines.patches import TARGET
from dapl_baselines.world_model.model import WorldModelConfig
from dapl_baselines.world_model.prediction import (
    POSITION_UNIT_M,
    ROTATION_UNIT_RAD,
    VELOCITY_UNIT_M_S,
    ObjectPrediction,
    Prediction,
)
from dapl_baselines.world_model.rigid_motion import fit_rigid_motion

Scalar = Float[Tensor, ""]
Points = Float[Tensor, "row point 3"]


class LossConfig(FileModel):
    """Weights and form of the terms; the defaults are the paper's appendix.

    Attributes:
        schema_version: Of these fields.
        position_weight: Of the position term.
        velocity_weight: Of the velocity term.
        variance_weight: Of the term that compares how much velocities vary.
        spread: ``variance``: squared difference of variances, as the appendix has it. ``standard_deviation``: length
            of the difference of standard deviations, as the main text has it.
    """

    schema_version: Literal[1] = 1
    position_weight: float = Field(default=1.0, ge=0, le=1e6)
    velocity_weight: float = Field(default=1.0, ge=0, le=1e6)
    variance_weight: float = Field(default=100.0, ge=0, le=1e6)
    spread: Literal["variance", "standard_deviation"] = "variance"


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Loss:
    """What is made small, and the terms it is the weighted sum of.

    Attributes:
        total: The weighted sum.
        terms: The terms before they are weighted, by name, without gradients.
    """

    total: Scalar
    terms: Mapping[str, Scalar]


def world_model_loss(
    prediction: Prediction,
    cloud: Float[Tensor, "row 1280 7"],
    next_positions: Float[Tensor, "row 1280 3"],
    next_velocities: Float[Tensor, "row 1280 3"],
    model: WorldModelConfig,
    loss: LossConfig,
) -> Loss:
    """The loss of any of the tasks.

    Args:
        prediction: What the model made of the clouds.
        cloud: The clouds it was given.
        next_positions: Where the points are one step later [m].
        next_velocities: How they move then [m/s].
        model: The model's configuration.
        loss: Weights and form.
    """
    if isinstance(prediction, ObjectPrediction):
        return object_loss(prediction, cloud[:, TARGET.of_cloud, :3], next_positions[:, TARGET.of_cloud], loss)
    if model.task == "reconstruction":
        return reconstruction_loss(prediction, cloud, loss, with_velocity=model.sees_velocity)
    return point_loss(prediction, next_positions, next_velocities, loss)


def point_loss(prediction: Prediction, positions: Points, velocities: Points, config: LossConfig) -> Loss:
    """Positions, velocities, and the spread of velocities, of all points."""
    return _weighted(
        position=(config.position_weight, squared_error(prediction.positions, positions, POSITION_UNIT_M)),
        velocity=(config.velocity_weight, squared_error(prediction.velocities, velocities, VELOCITY_UNIT_M_S)),
        variance=(config.variance_weight, spread_error(prediction.velocities, velocities, config.spread)),
    )


def reconstruction_loss(
    prediction: Prediction, cloud: Float[Tensor, "row point 7"], config: LossConfig, *, with_velocity: bool
) -> Loss:
    """Positions and, where they are an input, velocities of the points that went in."""
    weight = config.velocity_weight if with_velocity else 0.0
    return _weighted(
        position=(config.position_weight, squared_error(prediction.positions, cloud[..., :3], POSITION_UNIT_M)),
        velocity=(weight, squared_error(prediction.velocities, cloud[..., 4:], VELOCITY_UNIT_M_S)),
    )


def object_loss(prediction: ObjectPrediction, before: Points, after: Points, config: LossConfig) -> Loss:
    """Translation and 6-D rotation of the target, against the rigid motion that its points made.

    Both terms have the position's weight. The rotation's is the squared distance of the first two columns.

    Args:
        prediction: The pose change.
        before: The target's points [m].
        after: The same points one step later [m].
        config: Weights.
    """
    translation, rotation = fit_rigid_motion(before, after)
    columns = rotation[..., :2].mT.flatten(1)
    return _weighted(
        translation=(config.position_weight, squared_error(prediction.translation, translation, POSITION_UNIT_M)),
        rotation=(config.position_weight, squared_error(prediction.rotation_6d, columns, ROTATION_UNIT_RAD)),
    )


def squared_error(values: Float[Tensor, "*batch axis"], truth: Float[Tensor, "*batch axis"], unit: float) -> Scalar:
    """Mean squared length of the differences, in squared units (paper: L_pos, L_vel)."""
    return ((values - truth) / unit).square().sum(dim=-1).mean()


def spread_error(velocities: Points, truth: Points, spread: Literal["variance", "standard_deviation"]) -> Scalar:
    """How differently predicted and true velocities vary over all points and rows of the batch (paper: L_var).

    A model that answers every still scene right and every moving one with zero is caught by this term.
    """
    predicted, true = _variance(velocities), _variance(truth)
    match spread:
        case "variance":
            return (predicted - true).square().sum()
        case "standard_deviation":
            # The slope of a square root at zero is infinite.
            return torch.linalg.vector_norm((predicted + 1e-8).sqrt() - (true + 1e-8).sqrt())
        case _:
            assert_never(spread)


def _variance(velocities: Points) -> Float[Tensor, "3"]:
    return (velocities / VELOCITY_UNIT_M_S).flatten(0, 1).var(dim=0, correction=0)


def _weighted(**terms: tuple[float, Scalar]) -> Loss:
    total = torch.stack([weight * term for weight, term in terms.values()]).sum()
    return Loss(total=total, terms={name: term.detach() for name, (_, term) in terms.items()})
