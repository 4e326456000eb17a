"""The encoder of CORN (Cho et al. 2024): the patches of the target, and where the hand is.

It sees neither other objects nor what moves. Sizes are those of the authors' public configuration.
"""

from dataclasses import dataclass
from typing import Final, Literal

import torch
from jaxtyping import Float, Int
from pydantic import Field, model_validator
from torch import Tensor, nn

from clutter6d.envs.observation import OBSERVATION_SHAPES
from clutter6d.schema import FileModel
from dapl_baselines.encoders.point_encoder import PointEncoder
from dapl_baselines.encoders.transformer import SelfAttentionBlock
from dapl_baselines.patches import PATCH_POINTS, TARGET, cut_target
from dapl_baselines.tokenizer import gather_points

CENTRE_M: Final = (0.0, 0.0, 0.15)
"""What positions are counted from, world frame: the point above the table that the authors' clouds are centred at."""

SCALE_M: Final = 0.4
"""What positions are divided by."""

HAND_NUMBERS: Final = OBSERVATION_SHAPES["hand_state"][0]


class CornEncoderConfig(FileModel):
    """Sizes of the encoder; the defaults are the published ones.

    Attributes:
        schema_version: Of these fields.
        name: In the registry of encoders.
        patch_hidden_size: Units of the two hidden layers that a patch goes through.
        token_size: Size of a token.
        blocks: Transformer blocks.
        heads: Attention heads, a divisor of the token size.
        mlp_ratio: Units of a block's hidden layer, in token sizes.
    """

    schema_version: Literal[1] = 1
    name: Literal["corn"] = "corn"
    patch_hidden_size: int = Field(default=256, ge=1, le=1024)
    token_size: int = Field(default=128, ge=8, le=1024)
    blocks: int = Field(default=2, ge=1, le=48)
    heads: int = Field(default=4, ge=1, le=64)
    mlp_ratio: int = Field(default=1, ge=1, le=8)

    @model_validator(mode="after")
    def _heads_divide_the_token(self) -> "CornEncoderConfig":
        if self.token_size % self.heads:
            raise ValueError(f"heads: {self.heads} do not divide the token size of {self.token_size}")
        return self


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TargetPatches:
    """The target's patches as CORN sees them.

    Attributes:
        centres: Of the patches, from :data:`CENTRE_M`, in units of :data:`SCALE_M`.
        offsets: Of their points from the centres, nearest first, in the same unit.
    """

    centres: Float[Tensor, "row 16 3"]
    offsets: Float[Tensor, "row 16 32 3"]


class CornEncoder(PointEncoder):
    """A token for each patch of the target, and one for the hand, through a small transformer.

    Args:
        config: Sizes.
    """

    token_count = TARGET.patches + 1
    centre_m: Tensor

    def __init__(self, config: CornEncoderConfig) -> None:
        super().__init__()
        self.config = config
        hidden, size = config.patch_hidden_size, config.token_size
        self.patch_layers = nn.Sequential(
            *_normed_layer(3 * PATCH_POINTS, hidden), *_normed_layer(hidden, hidden), nn.Linear(hidden, size)
        )
        self.place_layers = nn.Sequential(nn.Linear(3, size), nn.GELU(), nn.Linear(size, size - 3))
        self.hand_layer = nn.Linear(HAND_NUMBERS, size)
        self.blocks = nn.Sequential(
            *(SelfAttentionBlock(size, config.heads, config.mlp_ratio) for _ in range(config.blocks))
        )
        self.norm = nn.LayerNorm(size)
        self.register_buffer("centre_m", torch.tensor(CENTRE_M), persistent=False)

    @property
    def token_size(self) -> int:
        """Size of a token."""
        return self.config.token_size

    def forward(
        self, cloud: Float[Tensor, "row 1280 7"], hand: Float[Tensor, "row 9"]
    ) -> Float[Tensor, "row 17 token"]:
        """As :meth:`PointEncoder.forward`: the tokens of the target's patches, then the hand's."""
        target = cloud[:, TARGET.of_cloud, :3]
        return self.encode(self.see(target, cut_target(target)), hand)

    def see(self, target: Float[Tensor, "row 512 3"], indices: Int[Tensor, "row 16 32"]) -> TargetPatches:
        """The patches of targets.

        Args:
            target: Points [m], world frame.
            indices: Points of each patch, its centre first.
        """
        points = (gather_points(target, indices) - self.centre_m) / SCALE_M
        centres = points[:, :, 0]
        offsets = points - centres[:, :, None]
        nearest = offsets.square().sum(dim=-1).argsort(dim=-1)
        return TargetPatches(centres=centres, offsets=offsets.gather(2, nearest[..., None].expand_as(offsets)))

    def encode(self, patches: TargetPatches, hand: Float[Tensor, "row 9"]) -> Float[Tensor, "row 17 token"]:
        """The tokens of patches that are cut already, and of hand poses in the world frame."""
        shapes = self.patch_layers(patches.offsets.flatten(2))
        places = torch.cat([patches.centres, self.place_layers(patches.centres)], dim=-1)
        pose = torch.cat([(hand[:, :3] - self.centre_m) / SCALE_M, hand[:, 3:]], dim=1)
        tokens = torch.cat([shapes + places, self.hand_layer(pose)[:, None]], dim=1)
        return self.norm(self.blocks(tokens))


def _normed_layer(inputs: int, outputs: int) -> tuple[nn.Module, ...]:
    return nn.Linear(inputs, outputs), nn.LayerNorm(outputs), nn.GELU()
