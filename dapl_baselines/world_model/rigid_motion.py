"""Rigid motions of point sets, batched."""

import torch
from jaxtyping import Float
from torch import Tensor


def matrix_from_6d(rotation_6d: Float[Tensor, "row 6"]) -> Float[Tensor, "row 3 3"]:
    """The rotation whose first column has the direction of the first half, and whose second leans to the other half."""
    first = torch.nn.functional.normalize(rotation_6d[:, :3], dim=-1)
    second = rotation_6d[:, 3:]
    second = second - (first * second).sum(dim=-1, keepdim=True) * first
    second = torch.nn.functional.normalize(second, dim=-1)
    return torch.stack([first, second, torch.linalg.cross(first, second)], dim=-1)


def move_rigidly(
    points: Float[Tensor, "row point 3"], translation: Float[Tensor, "row 3"], rotation: Float[Tensor, "row 3 3"]
) -> Float[Tensor, "row point 3"]:
    """Points rotated about their centroid and then translated."""
    centroid = points.mean(dim=1, keepdim=True)
    # Term by term: where matrix products are in bfloat16, this must not be.
    turned = ((points - centroid)[..., None, :] * rotation[:, None]).sum(dim=-1)
    return centroid + translation[:, None] + turned


@torch.no_grad()
def fit_rigid_motion(
    before: Float[Tensor, "row point 3"], after: Float[Tensor, "row point 3"]
) -> tuple[Float[Tensor, "row 3"], Float[Tensor, "row 3 3"]]:
    """The translation of the centroid and the rotation about it that bring points nearest to their later places.

    In the sense of least squares (Kabsch 1976); exact if the motion is rigid and the points are not all on one line.

    Args:
        before: Points [m].
        after: The same points later [m].
    """
    centroids = before.mean(dim=1, keepdim=True), after.mean(dim=1, keepdim=True)
    left, _, right = torch.linalg.svd((after - centroids[1]).mT.double() @ (before - centroids[0]).double())
    handedness = torch.linalg.det(left @ right).sign()
    left = torch.cat([left[..., :2], left[..., 2:] * handedness[:, None, None]], dim=-1)
    return (centroids[1] - centroids[0])[:, 0], (left @ right).to(before.dtype)
