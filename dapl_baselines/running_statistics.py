"""Running mean and scale of what enters a network (paper, appendix "Physical Attribute")."""

from collections.abc import Sequence

import torch
from jaxtyping import Float
from torch import Tensor, nn

MIN_RELATIVE_DEVIATION = 1e-5
"""A feature that deviates from its mean by a smaller share than this is constant up to its rounding."""
MIN_DEVIATION = 1e-6
"""So is one that deviates by less than this: a micrometre, a micrometre a second, a milligram. It matters where the
mean is near zero, as that of velocities of what stands still."""


class RunningStatistics(nn.Module):
    """Brings features to mean 0 and scale 1, as far as they vary at all.

    Mean and variance are those of all values ever shown to :meth:`update`, which counts in training mode alone. They
    are buffers: saved with the weights, never optimised, and the same in every batch. Before the first update nothing
    is changed.

    Args:
        groups: Features that share one scale, given as sizes. The three axes of a vector do, so that turning the
            scene turns what the network sees.
    """

    mean: Tensor
    variance: Tensor
    count: Tensor

    def __init__(self, groups: Sequence[int]) -> None:
        super().__init__()
        self._groups = tuple(groups)
        self.register_buffer("mean", torch.zeros(sum(groups)))
        self.register_buffer("variance", torch.ones(sum(groups)))
        self.register_buffer("count", torch.zeros((), dtype=torch.int64))

    @torch.no_grad()
    def update(self, values: Float[Tensor, "*batch feature"]) -> None:
        """Take values into account; in evaluation mode nothing happens.

        The statistics of both sides are merged exactly (Chan, Golub and LeVeque 1979), so that it does not matter how
        values are cut into batches.
        """
        if not self.training or values.numel() == 0:
            return
        rows = values.detach().reshape(-1, values.shape[-1]).double()
        variance, mean = torch.var_mean(rows, dim=0, correction=0)
        seen = self.count.double()
        share = len(rows) / (seen + len(rows))
        shift = mean - self.mean
        spread = torch.lerp(self.variance.double(), variance, share) + shift.square() * share * (1 - share)
        self.mean.add_(shift * share)
        self.variance.copy_(spread)
        self.count.add_(len(rows))

    @property
    def scale(self) -> Float[Tensor, "feature"]:
        """Standard deviation of each feature, root mean square over its group; 1 where it is constant."""
        scales: list[Tensor] = []
        for variance, mean in zip(self.variance.split(self._groups), self.mean.split(self._groups), strict=True):
            spread, offset = variance.mean(), mean.square().mean()
            is_constant = spread <= MIN_DEVIATION**2 + MIN_RELATIVE_DEVIATION**2 * offset
            scales.append(torch.where(is_constant, 1.0, spread).sqrt().expand(len(variance)))
        return torch.cat(scales)

    def forward(self, values: Float[Tensor, "*batch feature"]) -> Float[Tensor, "*batch feature"]:
        """The values in units of their scale about their mean."""
        return (values - self.mean) / self.scale

    def undo(self, values: Float[Tensor, "*batch feature"]) -> Float[Tensor, "*batch feature"]:
        """Values as they were before."""
        return values * self.scale + self.mean
