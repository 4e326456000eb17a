"""Prediction errors: how far predicted points are from the true ones 0.1 s later, beside what needs no learning.

P.E. is the paper's: the Chamfer distance between predicted and true points, in centimetres; here the mean of the two
directed means of nearest-neighbour distances (:func:`clutter6d.eval.metrics.chamfer_distance_m`). Beside it stands the
mean distance of each point to itself, which a surface cannot hide by sliding along itself.

Most of a scene stands still and is predicted by copying it. So errors are given for four sets of points: all; the
objects' (all but the hand's, whose motion the action tells); those that move; and those of objects that move. A
cloud without such points does not count.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, get_args

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from clutter6d.eval.metrics import chamfer_distance_m
from dapl_baselines.interactions.dataset import MOVING_M
from dapl_baselines.patches import END_EFFECTOR
from dapl_baselines.world_model.prediction import STEP_S

PointSet = Literal["all", "objects", "moving", "moving_objects"]
POINT_SETS: Final[tuple[PointSet, ...]] = get_args(PointSet)
Floor = Literal["copy", "constant_velocity"]
FLOORS: Final[tuple[Floor, ...]] = get_args(Floor)

_CM: Final = 100.0


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class CloudErrors:
    """Errors of clouds in one set of points.

    Attributes:
        chamfer_cm: Chamfer distance between predicted and true points; of clouds that count.
        distance_cm: Mean distance of predicted points to where they truly are; of the same clouds.
    """

    chamfer_cm: Float[Tensor, "counted"]
    distance_cm: Float[Tensor, "counted"]


def floor_positions(cloud: Float[Tensor, "row point 7"]) -> Mapping[Floor, Float[Tensor, "row point 3"]]:
    """What needs no learning: every point stays, or goes on at its velocity."""
    positions = cloud[..., :3]
    return {"copy": positions, "constant_velocity": positions + STEP_S * cloud[..., 4:]}


def prediction_errors(
    predicted: Float[Tensor, "row point 3"],
    now: Float[Tensor, "row point 3"],
    later: Float[Tensor, "row point 3"],
    sets: Sequence[PointSet] = POINT_SETS,
) -> Mapping[PointSet, CloudErrors]:
    """Errors of predicted positions [m] in sets of points.

    Args:
        predicted: Where the points should be in 0.1 s.
        now: Where they are.
        later: Where they truly are then.
        sets: Which sets.
    """
    return {name: _errors(predicted, later, points_in(name, now, later)) for name in sets}


def points_in(
    name: PointSet, now: Float[Tensor, "row point 3"], later: Float[Tensor, "row point 3"]
) -> Bool[Tensor, "row point"]:
    """Which points belong to a set; moving are those displaced by more than ``MOVING_M``."""
    moves = torch.linalg.vector_norm(later - now, dim=-1) > MOVING_M
    chosen = moves if name.startswith("moving") else torch.ones_like(moves)
    if name.endswith("objects"):
        chosen = chosen.clone()
        chosen[:, END_EFFECTOR.of_cloud] = False
    return chosen


def _errors(
    predicted: Float[Tensor, "row point 3"], later: Float[Tensor, "row point 3"], chosen: Bool[Tensor, "row point"]
) -> CloudErrors:
    counts = chosen.any(dim=1)
    predicted, later, chosen = predicted[counts], later[counts], chosen[counts]
    distances = torch.linalg.vector_norm(predicted - later, dim=-1)
    return CloudErrors(
        chamfer_cm=_CM * chamfer_distances(predicted, later, chosen), distance_cm=_CM * _mean_of(distances, chosen)
    )


def chamfer_distances(
    a: Float[Tensor, "row point 3"], b: Float[Tensor, "row point 3"], chosen: Bool[Tensor, "row point"]
) -> Float[Tensor, "row"]:
    """Chamfer distance [m] of the chosen points of both clouds of each row; at least one must be chosen.

    Cloud by cloud with trees: the table of all distances of a batch takes nine times as long, at its best.
    """
    clouds = zip(a.numpy(), b.numpy(), chosen.numpy(), strict=True)
    return torch.tensor([chamfer_distance_m(here[which], there[which]) for here, there, which in clouds])


def _mean_of(values: Float[Tensor, "row point"], chosen: Bool[Tensor, "row point"]) -> Float[Tensor, "row"]:
    return values.where(chosen, 0.0).sum(dim=1) / chosen.sum(dim=1)
