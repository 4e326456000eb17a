"""What a policy makes of time: the present frame looks at those before it.

A frame is what the policy makes of one observation: the features that the trunk fuses of it, then a 1. Before an
episode's start there were none, and all their numbers are 0. So a memory is one tensor, and an empty one is zeros.
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn

from dapl_baselines.encoders.transformer import CrossAttentionBlock
from dapl_baselines.policy.config import HISTORY_HEADS

_MLP_RATIO = 2


def make_frames(features: Float[Tensor, "row fused"]) -> Float[Tensor, "row frame"]:
    """Frames of features: that there is a frame is said by a 1 at its end."""
    return torch.cat([features, torch.ones_like(features[:, :1])], dim=1)


def features_of(frames: Float[Tensor, "*row frame"]) -> Float[Tensor, "*row fused"]:
    """Features of frames; 0 where there is none."""
    return frames[..., :-1].contiguous()


class FrameAttention(nn.Module):
    """From the last frames to ``g``: a transformer block whose only query is the present frame.

    The paper has its student "infer effective dynamics from temporal cues" (appendix, "Dynamics Distillation and
    Estimation") and leaves the architecture open. Every frame is known by its age, through a learned embedding.

    Args:
        size: Features of a frame; a multiple of ``HISTORY_HEADS``.
        history: Frames, the present one among them.
    """

    def __init__(self, size: int, history: int) -> None:
        super().__init__()
        self.ages = nn.Parameter(0.02 * torch.randn(history, size))
        self.block = CrossAttentionBlock(size, HISTORY_HEADS, _MLP_RATIO)

    def forward(self, window: Float[Tensor, "row history frame"]) -> Float[Tensor, "row fused"]:
        """``g`` of each row.

        Args:
            window: The last frames, oldest first.
        """
        features, is_seen = features_of(window), window[..., -1] > 0
        return self.block(features[:, -1:], features + self.ages, is_seen)[:, 0]
