"""The paper's dynamics encoder: clouds to 40 tokens of contact and motion (paper, appendix "Dynamics Encoder")."""

from dataclasses import dataclass
from typing import Annotated, Final, Literal

from jaxtyping import Float
from pydantic import Field, model_validator
from torch import Tensor, nn

from clutter6d.schema import FileModel
from dapl_baselines.encoders.point_encoder import PointEncoder
from dapl_baselines.encoders.transformer import SelfAttentionBlock
from dapl_baselines.on_cpu import in_parts
from dapl_baselines.patches import PATCHES, Patches, cut_into_patches
from dapl_baselines.tokenizer import Features, PatchTokenizer

ROWS_AT_ONCE: Final = 32
"""Rows whose tokens go through the blocks at once on a CPU."""

HiddenSize = Annotated[int, Field(ge=1, le=1024)]


class DaplEncoderConfig(FileModel):
    """Sizes of the encoder; the defaults are the paper's where it gives one.

    Attributes:
        schema_version: Of these fields.
        name: In the registry of encoders.
        features: What is seen of a point.
        patch_hidden_sizes: Units of the two layers that each point of a patch goes through; the paper gives none.
        token_size: Size of a token, the paper's D.
        blocks: Transformer blocks.
        heads: Attention heads, a divisor of the token size.
        mlp_ratio: Units of a block's hidden layer, in token sizes; the paper gives none.
    """

    schema_version: Literal[1] = 1
    name: Literal["dapl"] = "dapl"
    features: Features = "xyz_mass_velocity"
    patch_hidden_sizes: tuple[HiddenSize, HiddenSize] = (64, 64)
    token_size: int = Field(default=128, ge=8, le=1024)
    blocks: int = Field(default=12, ge=1, le=48)
    heads: int = Field(default=8, ge=1, le=64)
    mlp_ratio: int = Field(default=4, ge=1, le=8)

    @model_validator(mode="after")
    def _heads_divide_the_token(self) -> "DaplEncoderConfig":
        if self.token_size % self.heads:
            raise ValueError(f"heads: {self.heads} do not divide the token size of {self.token_size}")
        return self


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class EncodedCloud:
    """Tokens, and the patches they are about.

    Attributes:
        tokens: One for each patch.
        patches: Where the patches are, and which points they hold.
    """

    tokens: Float[Tensor, "row 40 token"]
    patches: Patches


class DaplEncoder(PointEncoder):
    """Patch tokens through a transformer.

    The running statistics that bring the input to scale are part of the encoder. They change only when
    :meth:`update_statistics` is called in training mode.

    Args:
        config: Sizes.
    """

    token_count = PATCHES

    def __init__(self, config: DaplEncoderConfig) -> None:
        super().__init__()
        self.config = config
        self.tokenizer = PatchTokenizer(config.features, config.patch_hidden_sizes, config.token_size)
        self.blocks = nn.Sequential(
            *(SelfAttentionBlock(config.token_size, config.heads, config.mlp_ratio) for _ in range(config.blocks))
        )
        self.norm = nn.LayerNorm(config.token_size)

    @property
    def token_size(self) -> int:
        """Size of a token."""
        return self.config.token_size

    def forward(
        self,
        cloud: Float[Tensor, "row 1280 7"],
        hand: Float[Tensor, "row 9"],  # noqa: ARG002  told by its points
    ) -> Float[Tensor, "row 40 token"]:
        """As :meth:`PointEncoder.forward`: the tokens of target, environment and end-effector."""
        return self.encode(cloud).tokens

    def encode(self, cloud: Float[Tensor, "row 1280 7"]) -> EncodedCloud:
        """The tokens of clouds, and their patches."""
        patches = cut_into_patches(cloud[..., :3])
        tokens = in_parts(lambda part: self.norm(self.blocks(part)), self.tokenizer(cloud, patches), ROWS_AT_ONCE)
        return EncodedCloud(tokens=tokens, patches=patches)

    def update_statistics(self, cloud: Float[Tensor, "row 1280 7"]) -> None:
        """Take clouds into the running statistics of the input; in evaluation mode nothing happens."""
        self.tokenizer.update_statistics(cloud)
