"""The policy network (paper, "Details of Policy Learning", Architecture).

Patch tokens ``Z`` of the points and the environment state ``s_env`` meet in a cross-attention whose queries come from
``s_env``; its result and ``s_env`` are fused to ``g``, from which the actor and the critic read. With a history, what
is fused is remembered as a frame, and ``g`` is made of the last frames.
"""

from collections.abc import Sequence
from itertools import pairwise
from math import log
from typing import Final

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn.functional import scaled_dot_product_attention

from clutter6d.envs.action import ACTION_SIZE
from clutter6d.errors import InvalidValueError
from dapl_baselines.encoders.registry import make_encoder
from dapl_baselines.policy.config import PolicyNetworkConfig
from dapl_baselines.policy.frame_attention import FrameAttention, features_of, make_frames
from dapl_baselines.running_statistics import RunningStatistics

STATE_BOUND: Final = 10.0
"""Normalised numbers of the state are clipped here: what training never saw must not drown the rest."""


class StateCrossAttention(nn.Module):
    """Queries made from the state look at the tokens (as in CORN).

    With few queries and many tokens, it is cheaper to bring a query to the tokens than each token to the query:
    ``q . (W_k z) = (W_k^T q) . z``, and the values' projection can wait until the tokens are averaged. Projected once a
    query instead of once a token, they cost a fortieth with one query. A bias of the keys would change nothing.

    Args:
        state_size: Numbers in the state.
        token_size: Numbers in a token.
        queries: Query tokens.
        heads: Attention heads; they divide the token size.

    Raises:
        InvalidValueError: They do not.
    """

    def __init__(self, state_size: int, token_size: int, queries: int, heads: int) -> None:
        super().__init__()
        if token_size % heads:
            raise InvalidValueError(f"attention_heads is {heads}, which does not divide the tokens' size {token_size}")
        self.to_queries = nn.Linear(state_size, queries * token_size)
        self.to_keys = nn.Linear(token_size, token_size, bias=False)
        self.to_values = nn.Linear(token_size, token_size)
        self.project = nn.Linear(token_size, token_size)
        self._heads, self._size = heads, token_size

    def forward(
        self, state: Float[Tensor, "row state"], tokens: Float[Tensor, "row token size"]
    ) -> Float[Tensor, "row attended"]:
        """What each query found, one after the other."""
        part, parts = self._size // self._heads, (self._heads, -1, self._size)
        queries = self.to_queries(state).unflatten(1, (-1, self._heads, part))
        asked = torch.einsum("rqhp,hps->rqhs", queries, self.to_keys.weight.view(parts))
        # With an axis of one head: without it, the sum is slower, and ONNX does not know it.
        seen = tokens[:, None]
        looks = scaled_dot_product_attention(asked.flatten(1, 2)[:, None], seen, seen, scale=part**-0.5).view_as(asked)
        values = torch.einsum("rqhs,hps->rqhp", looks, self.to_values.weight.view(parts)).flatten(2)
        return self.project(values + self.to_values.bias).flatten(1)


class Trunk(nn.Module):
    """From ``s_env`` and ``Z`` to what is fused of them; without a history, the ``g`` that actor and critic share.

    Args:
        config: Sizes.
        token_size: Numbers in a token; ``None``: state only.
    """

    def __init__(self, config: PolicyNetworkConfig, token_size: int | None) -> None:
        super().__init__()
        size, queries = config.state_size, config.query_tokens
        self.statistics = RunningStatistics([1] * size)
        self.attention = None
        if token_size is not None:
            self.attention = StateCrossAttention(size, token_size, queries, config.attention_heads)
        self.fusion = mlp([size + queries * (token_size or 0), *config.fusion_sizes], ends_linear=False)

    def forward(
        self, state: Float[Tensor, "row state"], tokens: Float[Tensor, "row token size"] | None = None
    ) -> Float[Tensor, "row fused"]:
        """The fused features of each row.

        Args:
            state: ``s_env``, as observed.
            tokens: ``Z``, of any floating-point type; not needed without an encoder.
        """
        state = self.statistics(state).clamp(-STATE_BOUND, STATE_BOUND)
        if self.attention is None or tokens is None:
            return self.fusion(state)
        return self.fusion(torch.cat([self.attention(state, tokens.to(state.dtype)), state], dim=1))


class PolicyNetwork(nn.Module):
    """The whole network: encoder, trunk, memory, actor, critic, and the logarithm of the actions' standard deviation.

    Args:
        config: Sizes and the encoder.

    Raises:
        InvalidValueError: The heads of the cross-attention do not divide the encoder's tokens.
    """

    def __init__(self, config: PolicyNetworkConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder = None if config.encoder is None else make_encoder(config.encoder)
        self.trunk = Trunk(config, None if self.encoder is None else self.encoder.token_size)
        self.actor = make_head(config, ACTION_SIZE)
        self.critic = make_head(config, 1)
        self.log_std = make_log_std(config)
        self.over_time = None if config.history == 1 else FrameAttention(config.fusion_sizes[-1], config.history)

    def forward(
        self,
        state: Float[Tensor, "row state"],
        cloud: Float[Tensor, "row 1280 7"] | None = None,
        memory: Float[Tensor, "row past frame"] | None = None,
    ) -> Float[Tensor, "row 7"]:
        """The most likely joint residuals [rad].

        Args:
            state: ``s_env``, as observed.
            cloud: Target's, environment's and end effector's points; not needed without an encoder.
            memory: The frames before this one, oldest first; ``None``: there are none.
        """
        return self.act(self.window(self.see(state, cloud), memory))

    @property
    def frame_size(self) -> int:
        """Numbers in a frame."""
        return self.config.fusion_sizes[-1] + 1

    def see(
        self, state: Float[Tensor, "row state"], cloud: Float[Tensor, "row 1280 7"] | None = None
    ) -> Float[Tensor, "row frame"]:
        """The frame of an observation, which is all that is remembered of it; arguments as of :meth:`forward`."""
        if self.encoder is None or cloud is None:
            return self.see_tokens(state)
        return self.see_tokens(state, self.encoder(cloud, state[:, self.config.columns_of("hand_state")]))

    def see_tokens(
        self, state: Float[Tensor, "row state"], tokens: Float[Tensor, "row token size"] | None = None
    ) -> Float[Tensor, "row frame"]:
        """The frame of a state and of a cloud that is encoded already; arguments as of :class:`Trunk`."""
        return make_frames(self.trunk(state, tokens))

    def window(
        self, frame: Float[Tensor, "row frame"], memory: Float[Tensor, "row past frame"] | None = None
    ) -> Float[Tensor, "row history frame"]:
        """The last frames, oldest first: those of a memory, and the present one; without a memory, it alone."""
        past = frame.new_zeros(len(frame), self.config.history - 1, self.frame_size) if memory is None else memory
        return torch.cat([past, frame[:, None]], dim=1)

    def fuse(self, window: Float[Tensor, "row history frame"]) -> Float[Tensor, "row fused"]:
        """The representation ``g`` that actor and critic read."""
        return features_of(window[:, -1]) if self.over_time is None else self.over_time(window)

    def act(self, window: Float[Tensor, "row history frame"]) -> Float[Tensor, "row 7"]:
        """The most likely joint residuals [rad]."""
        return self.config.action_scale_rad * self.actor(self.fuse(window)).clamp(-1, 1)


def mlp(sizes: Sequence[int], *, ends_linear: bool = True) -> nn.Sequential:
    """Linear layers with ELU between them, and after the last one unless it ``ends_linear``."""
    layers: list[nn.Module] = []
    for inputs, outputs in pairwise(sizes):
        layers += [nn.Linear(inputs, outputs), nn.ELU()]
    return nn.Sequential(*(layers[:-1] if ends_linear else layers))


def make_head(config: PolicyNetworkConfig, outputs: int) -> nn.Sequential:
    """A head on ``g``: the paper's has two layers, the hidden one of 64 units."""
    return mlp([config.fusion_sizes[-1], *config.head_sizes, outputs])


def make_log_std(config: PolicyNetworkConfig) -> nn.Parameter:
    """One logarithm for each joint, whatever is seen."""
    return nn.Parameter(torch.full((ACTION_SIZE,), log(config.initial_std)))
