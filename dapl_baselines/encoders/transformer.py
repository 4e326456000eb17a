"""Pre-norm transformer blocks on small sets of tokens."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from dapl_baselines.on_cpu import is_on_cpu


def attend(
    queries: Float[Tensor, "row head query size"],
    keys: Float[Tensor, "row head key size"],
    values: Float[Tensor, "row head key size"],
    is_seen: Bool[Tensor, "row key"] | None = None,
) -> Float[Tensor, "row head query size"]:
    """Scaled dot-product attention, to the keys that are seen; ``None``: to all.

    On a CPU, torch's own takes one head of one row after the other, which for as few tokens as these is slower than two
    batched products. They are in float32 under autocast too: in bfloat16 a softmax takes twice as long.
    """
    if not is_on_cpu(queries):
        mask = None if is_seen is None else is_seen[:, None, None]
        return nn.functional.scaled_dot_product_attention(queries, keys, values, mask)
    with torch.autocast("cpu", enabled=False):
        q, k, v = (tensor.float().flatten(0, 1) for tensor in (queries, keys, values))
        scores = torch.baddbmm(q.new_empty(1, 1, 1), q, k.mT, beta=0, alpha=q.shape[-1] ** -0.5)
        if is_seen is not None:
            unseen = ~is_seen.repeat_interleave(queries.shape[1], dim=0)[:, None]
            scores = scores.masked_fill(unseen, torch.finfo(scores.dtype).min)
        return torch.bmm(scores.softmax(dim=-1), v).unflatten(0, queries.shape[:2]).to(queries.dtype)


class SelfAttention(nn.Module):
    """Multi-head attention of tokens to one another.

    Args:
        size: Of a token.
        heads: A divisor of ``size``.
    """

    def __init__(self, size: int, heads: int) -> None:
        super().__init__()
        self._heads = heads
        self.queries_keys_values = nn.Linear(size, 3 * size)
        self.output = nn.Linear(size, size)

    def forward(self, tokens: Float[Tensor, "row token size"]) -> Float[Tensor, "row token size"]:
        """What each token takes from the others."""
        queries, keys, values = (
            self.queries_keys_values(tokens).unflatten(-1, (3, self._heads, -1)).permute(2, 0, 3, 1, 4)
        )
        return self.output(attend(queries, keys, values).transpose(1, 2).flatten(2))


class CrossAttention(nn.Module):
    """Multi-head attention of tokens to a context.

    Args:
        size: Of a token.
        heads: A divisor of ``size``.
    """

    def __init__(self, size: int, heads: int) -> None:
        super().__init__()
        self._heads = heads
        self.queries = nn.Linear(size, size)
        self.keys_values = nn.Linear(size, 2 * size)
        self.output = nn.Linear(size, size)

    def forward(
        self,
        tokens: Float[Tensor, "row token size"],
        context: Float[Tensor, "row context size"],
        is_seen: Bool[Tensor, "row context"] | None = None,
    ) -> Float[Tensor, "row token size"]:
        """What each token takes from the context, or from what is seen of it."""
        queries = self.queries(tokens).unflatten(-1, (self._heads, -1)).transpose(1, 2)
        keys, values = self.keys_values(context).unflatten(-1, (2, self._heads, -1)).permute(2, 0, 3, 1, 4)
        return self.output(attend(queries, keys, values, is_seen).transpose(1, 2).flatten(2))


class SelfAttentionBlock(nn.Module):
    """Attention, then a perceptron, each on normalised tokens and added to them.

    Args:
        size: Of a token.
        heads: A divisor of ``size``.
        mlp_ratio: Units of the perceptron's hidden layer, in token sizes.
    """

    def __init__(self, size: int, heads: int, mlp_ratio: int) -> None:
        super().__init__()
        self.attention_norm = nn.LayerNorm(size)
        self.attention = SelfAttention(size, heads)
        self.mlp_norm = nn.LayerNorm(size)
        self.mlp = make_mlp(size, mlp_ratio * size, size)

    def forward(self, tokens: Float[Tensor, "row token size"]) -> Float[Tensor, "row token size"]:
        """The tokens, each with what it took from the others."""
        tokens = tokens + self.attention(self.attention_norm(tokens))
        return tokens + self.mlp(self.mlp_norm(tokens))


class CrossAttentionBlock(nn.Module):
    """As :class:`SelfAttentionBlock`, with the tokens attending to themselves and to further ones.

    Args:
        size: Of a token.
        heads: A divisor of ``size``.
        mlp_ratio: Units of the perceptron's hidden layer, in token sizes.
    """

    def __init__(self, size: int, heads: int, mlp_ratio: int) -> None:
        super().__init__()
        self.attention_norm = nn.LayerNorm(size)
        self.context_norm = nn.LayerNorm(size)
        self.attention = CrossAttention(size, heads)
        self.mlp_norm = nn.LayerNorm(size)
        self.mlp = make_mlp(size, mlp_ratio * size, size)

    def forward(
        self,
        tokens: Float[Tensor, "row token size"],
        context: Float[Tensor, "row context size"],
        is_seen: Bool[Tensor, "row context"] | None = None,
    ) -> Float[Tensor, "row token size"]:
        """The tokens, each with what it took from the context, or from what is seen of it."""
        tokens = tokens + self.attention(self.attention_norm(tokens), self.context_norm(context), is_seen)
        return tokens + self.mlp(self.mlp_norm(tokens))


def make_mlp(inputs: int, hidden: int, outputs: int) -> nn.Sequential:
    """Two layers with a GELU between them."""
    return nn.Sequential(nn.Linear(inputs, hidden), nn.GELU(), nn.Linear(hidden, outputs))
