"""The network that judges pushes."""

from dataclasses import dataclass
from typing import Final, Literal

import torch
from jaxtyping import Float
from pydantic import Field
from torch import Tensor, nn

from clutter6d.schema import FileModel
from dapl_baselines.on_cpu import is_on_cpu, keep_freed_memory
from dapl_baselines.push_policy.outcomes import Prices
from dapl_baselines.push_policy.push_frame import POINT_FEATURES, PushView, feature_count

MOTION_SIZE: Final = 6
PUSHES_AT_ONCE: Final = 256


class PushCriticConfig(FileModel):
    """Sizes of a critic.

    Attributes:
        schema_version: Of these fields.
        obstacles: Other objects in a scene.
        point_sizes: Units of the two layers that each surface point goes through.
        hidden_size: Units of the three layers after.
        segments: Segments that a decision is made among, near the target.
        whole_pushes: Whole pushes that it is made among.
        look_ahead: Of these, the best so many are tried in a copy of the simulation first; 0: the critic alone decides.
        prices: What it is trained to judge by.
    """

    schema_version: Literal[1] = 1
    obstacles: int = Field(default=3, ge=0, le=64)
    point_sizes: tuple[int, int] = (64, 64)
    hidden_size: int = Field(default=256, ge=1, le=4096)
    segments: int = Field(default=16, ge=1, le=4096)
    whole_pushes: int = Field(default=48, ge=1, le=4096)
    look_ahead: int = Field(default=0, ge=0, le=256)
    prices: Prices = Prices()


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Judgement:
    """What a critic expects of pushes.

    Attributes:
        gain: What the push itself brings.
        future: What comes after it, discounted.
        motion: How the target moves while it is carried out: displacement [1/8 m] and rotation vector [rad], in the
            frame of the push. Only learned from.
    """

    gain: Float[Tensor, "*push"]
    future: Float[Tensor, "*push"]
    motion: Float[Tensor, "*push 6"]

    @property
    def value(self) -> Float[Tensor, "*push"]:
        """What a decision is made by."""
        return self.gain + self.future


class PushCritic(nn.Module):
    """Judges pushes one by one: surface points, which see the push, then a small network on all there is.

    Args:
        config: Sizes.
        context_size: Further numbers that each push is judged by.
    """

    def __init__(self, config: PushCriticConfig, context_size: int = 0) -> None:
        super().__init__()
        keep_freed_memory()
        self.config = config
        features, (first, second) = feature_count(config.obstacles), config.point_sizes
        self.push_to_points = nn.Linear(features, first)
        self.point_input = nn.Linear(POINT_FEATURES, first)
        self.point_output = nn.Linear(first, second)
        self.input = nn.Linear(features + second + context_size, config.hidden_size)
        self.norm = nn.LayerNorm(config.hidden_size)
        self.layers = nn.Sequential(
            nn.Linear(config.hidden_size, config.hidden_size),
            nn.ReLU(inplace=True),
            nn.Linear(config.hidden_size, config.hidden_size),
            nn.ReLU(inplace=True),
        )
        self.output = nn.Linear(config.hidden_size, 2 + MOTION_SIZE)
        nn.init.zeros_(self.output.weight)
        nn.init.zeros_(self.output.bias)

    def forward(self, view: PushView, context: Float[Tensor, "row push context"] | None = None) -> Judgement:
        """What it expects of each push; on a CPU so many at a time that their points fit into the caches."""
        known = view.features if context is None else torch.cat([view.features, context], dim=-1)
        arrays = [array.flatten(0, 1) for array in (view.features, view.points, known)]
        at_once = PUSHES_AT_ONCE if is_on_cpu(known) else len(arrays[0])
        parts = zip(*(array.split(at_once) for array in arrays), strict=True)
        outputs = torch.cat([self._judge(*part) for part in parts]).unflatten(0, view.features.shape[:2])
        gain, future, motion = outputs.split([1, 1, MOTION_SIZE], dim=-1)
        return Judgement(gain=gain[..., 0], future=future[..., 0], motion=motion)

    def _judge(
        self,
        features: Float[Tensor, "push feature"],
        points: Float[Tensor, "push point 7"],
        known: Float[Tensor, "push known"],
    ) -> Float[Tensor, "push 8"]:
        seen = torch.relu(self.point_input(points) + self.push_to_points(features)[:, None])
        summary = torch.relu(self.point_output(seen).amax(dim=-2))
        hidden = torch.relu(self.norm(self.input(torch.cat([known, summary], dim=-1))))
        return self.output(self.layers(hidden))
