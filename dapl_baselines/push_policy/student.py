"""A critic of pushes that sees points alone: the teacher's network on what points tell, beside an encoder's tokens."""

from typing import Literal

import torch
from jaxtyping import Float
from pydantic import Field, model_validator
from torch import Tensor, nn

from clutter6d.schema import FileModel
from dapl_baselines.encoders.dapl import DaplEncoderConfig
from dapl_baselines.encoders.registry import EncoderConfig, make_encoder
from dapl_baselines.encoders.transformer import CrossAttention
from dapl_baselines.push_policy.critic import Judgement, PushCritic, PushCriticConfig
from dapl_baselines.push_policy.push_frame import PushView, feature_count


class PushStudentConfig(FileModel):
    """Sizes of a student.

    Attributes:
        schema_version: Of these fields.
        critic: Of the critic; it knows of no obstacle by itself, and cannot look ahead.
        encoder: Of the encoder, which is frozen.
        attention_heads: Of the cross-attention from pushes to tokens.
    """

    schema_version: Literal[1] = 1
    critic: PushCriticConfig = PushCriticConfig(obstacles=0)
    encoder: EncoderConfig = Field(default_factory=DaplEncoderConfig)
    attention_heads: int = Field(default=4, ge=1, le=64)

    @model_validator(mode="after")
    def _check(self) -> "PushStudentConfig":
        if self.critic.obstacles or self.critic.look_ahead:
            raise ValueError("critic: a student sees points alone: obstacles and look_ahead must be 0")
        if self.encoder.token_size % self.attention_heads:
            raise ValueError(f"attention_heads: {self.attention_heads} do not divide {self.encoder.token_size}")
        return self


class PushStudent(nn.Module):
    """Each push asks the tokens by cross-attention, as the state does in the paper's policy, to be judged by more.

    Args:
        config: Sizes.
    """

    def __init__(self, config: PushStudentConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder = make_encoder(config.encoder).requires_grad_(False)
        size = config.encoder.token_size
        self.query = nn.Linear(feature_count(0), size)
        self.token_norm = nn.LayerNorm(size)
        self.attention = CrossAttention(size, config.attention_heads)
        self.critic = PushCritic(config.critic, context_size=size)

    def encode(
        self, cloud: Float[Tensor, "row 1280 7"], hand: Float[Tensor, "row 9"]
    ) -> Float[Tensor, "row token size"]:
        """The tokens of what is observed, without gradients."""
        with torch.no_grad():
            return self.encoder(cloud, hand)

    def forward(self, view: PushView, tokens: Float[Tensor, "row token size"]) -> Judgement:
        """What it expects of each push."""
        answer = self.attention(self.query(view.features), self.token_norm(tokens))
        return self.critic(view, torch.relu(answer))
