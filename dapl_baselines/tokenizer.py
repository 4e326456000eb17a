"""Clouds to tokens: one for each patch, from its points in their local frame and from where its centre is."""

import math
from typing import Final, Literal

import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from dapl_baselines.on_cpu import in_parts
from dapl_baselines.patches import Patches, cut_into_patches
from dapl_baselines.running_statistics import RunningStatistics

Features = Literal["xyz", "xyz_velocity", "xyz_mass_velocity"]
FEATURES: Final[dict[Features, tuple[int, ...]]] = {
    "xyz": (0, 1, 2),
    "xyz_velocity": (0, 1, 2, 4, 5, 6),
    "xyz_mass_velocity": (0, 1, 2, 3, 4, 5, 6),
}
"""Which of a point's seven features a network sees (paper, Table "Ablation Study": columns Velocity and Phys.)."""

POINT_ROWS_AT_ONCE: Final = 8
"""Rows whose 1,280 points are embedded at once on a CPU."""

LONGEST_WAVE_M: Final = 4.0
SHORTEST_WAVE_M: Final = 0.02
"""The longest wave tells apart all places on the table, the shortest is about a patch's radius."""


class PatchTokenizer(nn.Module):
    """Paper, appendix "Tokenization": a PointNet of two shared layers and a maximum, a projection, and a position.

    A point enters with its offset from the patch's centre, its mass and its velocity, brought to mean 0 and scale 1.

    Args:
        features: What is seen of a point.
        hidden_sizes: Units of the two shared layers.
        token_size: Size of a token.
    """

    def __init__(self, features: Features, hidden_sizes: tuple[int, int], token_size: int) -> None:
        super().__init__()
        self.statistics = RunningStatistics(groups=(3, 1, 3))
        self._columns = FEATURES[features]
        self.point_layers = nn.Sequential(
            nn.Linear(len(self._columns), hidden_sizes[0]),
            nn.ReLU(inplace=True),
            nn.Linear(hidden_sizes[0], hidden_sizes[1]),
        )
        self.projection = nn.Linear(hidden_sizes[1], token_size)

    def forward(self, cloud: Float[Tensor, "row 1280 7"], patches: Patches) -> Float[Tensor, "row 40 token"]:
        """One token a patch; a token depends on the points of its own patch alone.

        Args:
            cloud: Points with all their features [m, kg, m/s].
            patches: How the clouds are cut.
        """
        points = self.statistics(_local_points(cloud, patches))
        if len(self._columns) < points.shape[-1]:
            points = points[..., list(self._columns)]
        summary = self.projection(in_parts(self._pool, points, POINT_ROWS_AT_ONCE))
        return summary + position_embedding(patches.centres, summary.shape[-1]).to(summary.dtype)

    def _pool(self, points: Float[Tensor, "row 40 32 feature"]) -> Float[Tensor, "row 40 hidden"]:
        return self.point_layers(points).amax(dim=2)

    def update_statistics(self, cloud: Float[Tensor, "row 1280 7"]) -> None:
        """Take clouds into the running statistics; in evaluation mode nothing happens."""
        if self.training:
            self.statistics.update(_local_points(cloud, cut_into_patches(cloud[..., :3])))


def gather_points(
    values: Float[Tensor, "row all value"], indices: Int[Tensor, "row patch point"]
) -> Float[Tensor, "row patch point value"]:
    """The values of the points of each patch."""
    rows, count, size = values.shape
    first = torch.arange(0, rows * count, count, device=indices.device)[:, None, None]
    return values.reshape(-1, size).index_select(0, (indices + first).flatten()).reshape(*indices.shape, size)


def position_embedding(positions: Float[Tensor, "*batch 3"], size: int) -> Float[Tensor, "*batch size"]:
    """Sines and cosines of each coordinate, at wavelengths from 4 m to 2 cm in equal ratios.

    Args:
        positions: Where [m], world frame.
        size: Of the embedding; what is left when it is divided by 6 stays zero.
    """
    count = size // 6
    shrink = math.log(SHORTEST_WAVE_M / LONGEST_WAVE_M) / max(count - 1, 1)
    waves = LONGEST_WAVE_M * torch.exp(shrink * torch.arange(count, device=positions.device))
    phases = (positions[..., None] * (2 * math.pi / waves)).flatten(-2)
    return nn.functional.pad(torch.cat([phases.sin(), phases.cos()], dim=-1), (0, size - 6 * count))


def _local_points(cloud: Float[Tensor, "row 1280 7"], patches: Patches) -> Float[Tensor, "row 40 32 7"]:
    """The points of each patch, their positions as offsets from its centre."""
    points = gather_points(cloud, patches.indices)
    return points - nn.functional.pad(patches.centres, (0, cloud.shape[-1] - 3))[:, :, None]
