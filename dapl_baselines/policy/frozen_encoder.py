"""The encoder while PPO runs: frozen, and asked once for each observation."""

from typing import Final

import torch
from jaxtyping import Float16, Float32
from torch import Tensor

from dapl_baselines.encoders.point_encoder import PointEncoder

STORED: Final = torch.float16
"""Of tokens in a rollout. They come from a layer norm, so their size suits it; half the room of float32."""


class FrozenEncoder:
    """Clouds and hand poses to stored tokens.

    Args:
        module: The encoder; it is not trained from here on.
        device: Where it runs.
        compute: Precision of its matrix products.
        batch: Clouds encoded at once; bounds the memory.
    """

    def __init__(self, module: PointEncoder, device: str, compute: torch.dtype, *, batch: int = 512) -> None:
        self.module = module.to(device).eval().requires_grad_(False)
        self._device, self._compute, self._batch = torch.device(device), compute, batch

    @torch.no_grad()
    def __call__(
        self, clouds: Float32[Tensor, "row 1280 7"], hands: Float32[Tensor, "row 9"]
    ) -> Float16[Tensor, "row token size"]:
        """The tokens of what is observed, rounded as they are stored."""
        rows = zip(clouds.split(self._batch), hands.split(self._batch), strict=True)
        with torch.autocast(self._device.type, self._compute, enabled=self._compute is not torch.float32):
            parts = [self.module(*part).to(STORED) for part in rows]
        return torch.cat(parts)
