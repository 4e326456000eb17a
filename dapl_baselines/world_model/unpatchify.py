"""From patches back to points (paper, appendix "Decoder")."""

from dataclasses import dataclass

import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from dapl_baselines.patches import COMPONENTS, PATCH_POINTS, PATCHES, Patches
from dapl_baselines.world_model.prediction import POSITION_UNIT_M


class Unpatchify(nn.Module):
    """Gives every point its patch's embedding plus an embedding of its offset from the patch's centre.

    A point of several patches gets the mean over them. A point of no patch gets what it would get if it belonged to the
    patch of its component whose centre is nearest: the paper does not say what such points get, and they are about a
    fifth of all (16 patches of 32 have as many places as an object has points, and overlap).

    Args:
        size: Of a patch's embedding.
        hidden_size: Units of the hidden layer that offsets go through.
    """

    def __init__(self, size: int, hidden_size: int) -> None:
        super().__init__()
        self.offset_layers = nn.Sequential(nn.Linear(3, hidden_size), nn.GELU())
        self.offset_output = nn.Linear(hidden_size, size)

    def forward(
        self, tokens: Float[Tensor, "row 40 size"], patches: Patches, positions: Float[Tensor, "row 1280 3"]
    ) -> Float[Tensor, "row 1280 size"]:
        """Embeddings of all points.

        Args:
            tokens: Embeddings of the patches.
            patches: Their points and centres.
            positions: The points [m], world frame.
        """
        places, shape = find_places(patches, positions), positions.shape[:2]
        offsets = positions.flatten(0, 1)[places.points] - patches.centres.flatten(0, 1)[places.patches]
        # The last layer of offsets is linear: its mean is that of what goes in, which is smaller.
        hidden = scatter_mean(self.offset_layers(offsets / POSITION_UNIT_M), places.points, shape.numel())
        mixture = mixing_weights(places, shape.numel()).unflatten(0, shape)
        return mixture @ tokens + self.offset_output(hidden).unflatten(0, shape)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Places:
    """Which point belongs to which patch, one place after the other; rows of a batch are counted through.

    Attributes:
        points: The point in each place, of all points of all rows.
        patches: The patch that the place is of, of all patches of all rows.
    """

    points: Int[Tensor, "place"]
    patches: Int[Tensor, "place"]


@torch.no_grad()
def find_places(patches: Patches, positions: Float[Tensor, "row 1280 3"]) -> Places:
    """The places of all patches, and one in the nearest patch for each point that is in none.

    Args:
        patches: Points and centres.
        positions: The points [m].
    """
    rows, count, _ = positions.shape
    first = torch.arange(rows, device=positions.device)[:, None]
    points = (patches.indices.flatten(1) + first * count).flatten()
    of_patch = torch.arange(rows * PATCHES, device=points.device).repeat_interleave(PATCH_POINTS)
    is_missing = torch.ones(rows * count, dtype=torch.bool, device=points.device)
    is_missing[points] = False
    nearest = (nearest_patches(positions, patches.centres) + first * PATCHES).flatten()
    return Places(
        points=torch.cat([points, is_missing.nonzero()[:, 0]]), patches=torch.cat([of_patch, nearest[is_missing]])
    )


def mixing_weights(places: Places, count: int) -> Float[Tensor, "count 40"]:
    """How much each patch counts for each point: a matrix product with the patches of its row gives their mean.

    Args:
        places: Which point belongs to which patch.
        count: Points of all rows.
    """
    belongs = torch.zeros(count, PATCHES, device=places.points.device)
    belongs[places.points, places.patches % PATCHES] = 1.0
    return belongs / belongs.sum(dim=1, keepdim=True)


def scatter_mean(
    values: Float[Tensor, "place size"], indices: Int[Tensor, "place"], count: int
) -> Float[Tensor, "count size"]:
    """The mean over the places of each index, in float32; where an index has no place, zero.

    Args:
        values: One for each place.
        indices: Where it goes.
        count: How many indices there are.
    """
    sums = values.new_zeros(count, values.shape[-1], dtype=torch.float32).index_add(0, indices, values.float())
    ones = torch.ones(len(indices), device=values.device)
    return sums / torch.zeros(count, device=values.device).index_add(0, indices, ones).clamp(min=1)[:, None]


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
