"""Patches of a cloud: centres by farthest-point sampling, points by nearest neighbours, inside each component alone.

A cloud is 512 points of the target, then 512 of the environment, then 256 of the end-effector (paper, appendix
"Details of World Model"). Which points make a patch depends on nothing but the positions of the points of its own
component: not on their order, and not on the other rows of the batch. (Of points that are equally far to the bit, the
first counts; sampled surfaces have none.)
"""

from dataclasses import dataclass
from typing import Final

import torch
from jaxtyping import Float, Int
from torch import Tensor

from clutter6d.assets.asset import SURFACE_POINTS
from clutter6d.envs.point_cloud import ENVIRONMENT_POINTS, POINT_FEATURES
from clutter6d.sim.end_effector import END_EFFECTOR_POINTS
from dapl_baselines.on_cpu import is_on_cpu
from dapl_baselines.patch_kernel import compiled_patches


@dataclass(frozen=True, kw_only=True, slots=True)
class Component:
    """One of the three parts of a cloud.

    Attributes:
        start: Its first point in the cloud.
        points: How many points it has.
        patches: How many patches it is cut into.
    """

    start: int
    points: int
    patches: int

    @property
    def of_cloud(self) -> slice:
        """Its points in the cloud."""
        return slice(self.start, self.start + self.points)


TARGET: Final = Component(start=0, points=SURFACE_POINTS, patches=16)
ENVIRONMENT: Final = Component(start=TARGET.points, points=ENVIRONMENT_POINTS, patches=16)
END_EFFECTOR: Final = Component(start=TARGET.points + ENVIRONMENT.points, points=END_EFFECTOR_POINTS, patches=8)
COMPONENTS: Final = (TARGET, ENVIRONMENT, END_EFFECTOR)
CLOUD_POINTS: Final = sum(component.points for component in COMPONENTS)
CLOUD_FEATURES: Final = POINT_FEATURES
PATCHES: Final = sum(component.patches for component in COMPONENTS)
PATCH_POINTS: Final = 32


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Patches:
    """Which points of each cloud make its patches: 16 of the target, 16 of the environment, 8 of the end-effector.

    Attributes:
        indices: Points of each patch, as indices into the cloud; the centre first, the others in no particular order.
            A point may be in several patches, or in none.
        centres: The point that each patch is about [m], world frame.
    """

    indices: Int[Tensor, "row 40 32"]
    centres: Float[Tensor, "row 40 3"]


@torch.no_grad()
def cut_into_patches(positions: Float[Tensor, "row 1280 3"]) -> Patches:
    """The patches of clouds.

    Args:
        positions: Points [m], world frame; ordered as a cloud.
    """
    # Target and environment have as many points and patches as one another: one call cuts both.
    rows, large = len(positions), TARGET.points
    objects = _patches_of_component(positions[:, : 2 * large].reshape(2 * rows, large, 3), TARGET.patches)
    objects = objects.reshape(rows, 2, TARGET.patches, PATCH_POINTS)
    hand = _patches_of_component(positions[:, END_EFFECTOR.of_cloud], END_EFFECTOR.patches)
    parts = objects[:, 0], objects[:, 1] + ENVIRONMENT.start, hand + END_EFFECTOR.start
    indices = torch.cat(parts, dim=1)
    return Patches(indices=indices, centres=positions.gather(1, indices[..., :1].expand(-1, -1, 3)))


@torch.no_grad()
def cut_target(positions: Float[Tensor, "row 512 3"]) -> Int[Tensor, "row 16 32"]:
    """Which points make the patches of targets alone; as in clouds, the centre first.

    Args:
        positions: The targets' points [m].
    """
    return _patches_of_component(positions, TARGET.patches)


def _patches_of_component(positions: Float[Tensor, "batch point 3"], patches: int) -> Int[Tensor, "batch patch 32"]:
    if is_on_cpu(positions):
        points = positions.detach().float().contiguous().numpy()
        return torch.from_numpy(compiled_patches(points, patches, PATCH_POINTS, torch.get_num_threads()))
    return readable_patches(positions, patches)


def readable_patches(positions: Float[Tensor, "batch point 3"], patches: int) -> Int[Tensor, "batch patch 32"]:
    """Patches of clouds of one component, on any device; on CPUs :mod:`dapl_baselines.patch_kernel` is faster.

    Args:
        positions: Points [m].
        patches: How many patches to cut.

    Returns:
        Indices of the points of each patch, its centre first.
    """
    centres, squared = farthest_points(positions, patches)
    # Less than any distance, so that a centre comes first among points that coincide with it.
    squared = squared.scatter(2, centres[..., None], -1.0)
    return squared.topk(PATCH_POINTS, dim=-1, largest=False).indices


def farthest_points(
    positions: Float[Tensor, "batch point 3"], count: int
) -> tuple[Int[Tensor, "batch count"], Float[Tensor, "batch count point"]]:
    """Points far from one another, chosen one by one.

    The first is farthest from the middle of the bounding box, each further one is farthest from all chosen ones. The
    box, unlike the mean, does not depend on the order of the points by as much as a bit. Distances are squared
    differences term by term: with matrix products they would change with the shape of the batch, and would be too
    inexact for neighbours a few millimetres apart.

    Args:
        positions: Points [m].
        count: How many to choose.

    Returns:
        Indices of the chosen points, and the squared distances of all points to each of them [m²].
    """
    axes = positions.transpose(1, 2).contiguous()
    middle = (axes.amin(dim=-1, keepdim=True) + axes.amax(dim=-1, keepdim=True)) / 2
    index = _squared_distances(axes, middle).argmax(dim=-1)
    nearest = torch.full_like(axes[:, 0], torch.inf)
    chosen: list[Tensor] = []
    squared: list[Tensor] = []
    for _ in range(count):
        distances = _squared_distances(axes, axes.gather(2, index[:, None, None].expand(-1, 3, 1)))
        nearest = torch.minimum(nearest, distances)
        chosen.append(index)
        squared.append(distances)
        index = nearest.argmax(dim=-1)
    return torch.stack(chosen, dim=1), torch.stack(squared, dim=1)


def _squared_distances(
    axes: Float[Tensor, "batch 3 point"], reference: Float[Tensor, "batch 3 1"]
) -> Float[Tensor, "batch point"]:
    x, y, z = (axes - reference).square_().unbind(dim=1)
    return x + y + z
