"""Decoders: tokens and an action to the motion of points, or of the target as a whole."""

import torch
from jaxtyping import Float
from torch import Tensor, nn

from dapl_baselines.encoders.dapl import EncodedCloud
from dapl_baselines.encoders.transformer import CrossAttentionBlock
from dapl_baselines.patches import TARGET
from dapl_baselines.world_model.prediction import POSITION_UNIT_M
from dapl_baselines.world_model.unpatchify import Unpatchify

HEAD_HIDDEN_SIZE = 64
"""Units of the hidden layers of heads and of the embedding of offsets; the paper gives none."""


class ActionFusion(nn.Module):
    """Tokens that know of the action (paper, appendix "Decoder").

    The action becomes a token, and the patch tokens attend to it and to one another in one transformer layer. With the
    action's token as the only one to attend to, every weight would be 1 and no patch could take it differently.

    Args:
        size: Of a token.
        heads: Attention heads.
        mlp_ratio: Units of the hidden layer, in token sizes.
    """

    def __init__(self, size: int, heads: int, mlp_ratio: int) -> None:
        super().__init__()
        self.action_embedding = nn.Linear(3, size)
        self.block = CrossAttentionBlock(size, heads, mlp_ratio)

    def forward(
        self, tokens: Float[Tensor, "row 40 size"], flow: Float[Tensor, "row 3"]
    ) -> Float[Tensor, "row 40 size"]:
        """The tokens, given how far the end-effector moves in the step [m]."""
        action = self.action_embedding(flow / POSITION_UNIT_M)[:, None]
        return self.block(tokens, torch.cat([tokens, action.to(tokens.dtype)], dim=1))


class PointHeads(nn.Module):
    """Positions and velocities of all points from the tokens of their patches, in parallel heads.

    Args:
        size: Of a token.
        outputs: Numbers that each head gives for a point.
    """

    def __init__(self, size: int, outputs: int) -> None:
        super().__init__()
        self.unpatchify = Unpatchify(size, HEAD_HIDDEN_SIZE)
        self.norm = nn.LayerNorm(size)
        self.position = _make_head(size, outputs)
        self.velocity = _make_head(size, outputs)

    def forward(
        self, encoded: EncodedCloud, positions: Float[Tensor, "row 1280 3"]
    ) -> tuple[Float[Tensor, "row 1280 output"], Float[Tensor, "row 1280 output"]]:
        """What the position head and the velocity head say of each point; units are the caller's."""
        points = self.norm(self.unpatchify(encoded.tokens, encoded.patches, positions))
        return self.position(points).float(), self.velocity(points).float()


class PoseHead(nn.Module):
    """Motion of the target as a whole, from the mean of its tokens.

    Args:
        size: Of a token.
    """

    def __init__(self, size: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(size)
        self.pose = _make_head(size, 9)

    def forward(self, tokens: Float[Tensor, "row 40 size"]) -> Float[Tensor, "row 9"]:
        """Translation and how far the 6-D rotation is from none; units are the caller's."""
        return self.pose(self.norm(tokens[:, : TARGET.patches].mean(dim=1))).float()


def _make_head(size: int, outputs: int) -> nn.Sequential:
    """Two layers that put out zero until they are trained: a fresh model predicts that nothing hits anything."""
    output = nn.Linear(HEAD_HIDDEN_SIZE, outputs)
    nn.init.zeros_(output.weight)
    nn.init.zeros_(output.bias)
    return nn.Sequential(nn.Linear(size, HEAD_HIDDEN_SIZE), nn.GELU(), output)
