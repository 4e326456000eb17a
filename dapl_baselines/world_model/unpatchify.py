"""From patches back to points (paper, appendix "Decoder")."""

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn

from dapl_baselines.encoders.transformer import make_mlp
from dapl_baselines.patches import COMPONENTS
from dapl_baselines.tokenizer import Patches, gather_points
from dapl_baselines.world_model.prediction import POSITION_UNIT_M


class Unpatchify(nn.Module):
    """Gives every point its patch's embedding plus an embedding of its offset from the patch's centre.

    A point of several patches gets the mean over them. A point of no patch gets what it would get if it belonged to the
    patch of its component whose centre is nearest: the paper does not say what such points get, and they are about a
    third of the objects' points (16 patches of 32 have as many places as an object has points, and overlap).

    Args:
        size: Of a patch's embedding.
        hidden_size: Units of the hidden layer that offsets go through.
    """

    def __init__(self, size: int, hidden_size: int) -> None:
        super().__init__()
        self.offset_embedding = make_mlp(3, hidden_size, size)

    def forward(
        self,
        tokens: Float[Tensor, "row 40 size"],
        patches: Patches,
        positions: Float[Tensor, "row 1280 3"],
    ) -> Float[Tensor, "row 1280 size"]:
        """Embeddings of all points.

        Args:
            tokens: Embeddings of the patches.
            patches: Their points and centres.
            positions: The points [m], world frame.
        """
        inside = tokens[:, :, None] + self._embed(local_offsets(positions, patches))
        means, is_covered = scatter_mean(inside, patches.indices, positions.shape[1])
        nearest = nearest_patches(positions, patches.centres)
        offsets = positions - patches.centres.gather(1, nearest[..., None].expand(-1, -1, 3))
        outside = tokens.gather(1, nearest[..., None].expand(-1, -1, tokens.shape[-1])) + self._embed(offsets)
        return torch.where(is_covered[..., None], means, outside)

    def _embed(self, offsets: Float[Tensor, "*point 3"]) -> Float[Tensor, "*point size"]:
        return self.offset_embedding(offsets / POSITION_UNIT_M)


def local_offsets(positions: Float[Tensor, "row 1280 3"], patches: Patches) -> Float[Tensor, "row 40 32 3"]:
    """Offsets of the points of each patch from its centre [m]."""
    return gather_points(positions, patches.indices) - patches.centres[:, :, None]


def scatter_mean(
    values: Float[Tensor, "row patch place size"], indices: Int[Tensor, "row patch place"], points: int
) -> tuple[Float[Tensor, "row point size"], Bool[Tensor, "row point"]]:
    """The mean over the places that hold each point, in float32, and which points are in any place at all.

    Sums are made in the order of the places; where no place holds a point, the mean is zero.

    Args:
        values: One for each place of each patch.
        indices: The point in each place.
        points: Points of a cloud.
    """
    rows, size = len(values), values.shape[-1]
    first = torch.arange(0, rows * points, points, device=indices.device)[:, None, None]
    flat = (indices + first).flatten()
    sums = values.new_zeros(rows * points, size, dtype=torch.float32)
    sums = sums.index_add(0, flat, values.reshape(-1, size).float())
    counts = torch.bincount(flat, minlength=rows * points)
    return (sums / counts.clamp(min=1)[:, None]).reshape(rows, points, size), (counts > 0).reshape(rows, points)


@torch.no_grad()
def nearest_patches(
    positions: Float[Tensor, "row 1280 3"], centres: Float[Tensor, "row 40 3"]
) -> Int[Tensor, "row 1280"]:
    """For each point, the patch of its own component whose centre is nearest."""
    nearest: list[Tensor] = []
    first = 0
    for component in COMPONENTS:
        own = centres[:, first : first + component.patches]
        distances = torch.cdist(positions[:, component.of_cloud], own, compute_mode="donot_use_mm_for_euclid_dist")
        nearest.append(distances.argmin(dim=-1) + first)
        first += component.patches
    return torch.cat(nearest, dim=1)
