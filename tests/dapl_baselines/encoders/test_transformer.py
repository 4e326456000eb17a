import numpy as np
import pytest
import torch
from torch.nn.functional import scaled_dot_product_attention

from dapl_baselines.encoders.transformer import CrossAttentionBlock, SelfAttentionBlock, attend


def make_heads(queries: int, keys: int) -> list[torch.Tensor]:
    torch.manual_seed(0)
    return [torch.randn(3, 2, count, 4) for count in (queries, keys, keys)]


@pytest.mark.parametrize(("queries", "keys"), [(5, 5), (5, 6), (1, 7)])
def test_attention_is_a_softmax_over_scaled_products(queries, keys):
    q, k, v = (tensor.double().numpy() for tensor in make_heads(queries, keys))
    expected = np.zeros_like(q)
    for row in range(3):
        for head in range(2):
            for query in range(queries):
                weights = np.exp(k[row, head] @ q[row, head, query] / np.sqrt(4))
                expected[row, head, query] = (weights / weights.sum()) @ v[row, head]
    assert np.allclose(attend(*make_heads(queries, keys)).numpy(), expected, atol=1e-5)


def test_attention_to_what_is_seen_is_attention_without_the_rest():
    q, k, v = make_heads(2, 5)
    is_seen = torch.tensor([[0, 1, 0, 1, 1], [1, 1, 1, 1, 1], [0, 0, 0, 0, 1]]).bool()
    for row, seen in enumerate(is_seen):
        alone = attend(q[row, None], k[row, None, :, seen], v[row, None, :, seen])[0]
        assert torch.allclose(attend(q, k, v, is_seen)[row], alone, atol=1e-6)
    other = torch.where(is_seen[:, None, :, None], v, 1e6)
    assert torch.equal(attend(q, k, other, is_seen), attend(q, k, v, is_seen))


def test_attention_and_its_slopes_are_those_of_torch():
    ours = [tensor.requires_grad_() for tensor in make_heads(5, 6)]
    theirs = [tensor.requires_grad_() for tensor in make_heads(5, 6)]
    attend(*ours).square().sum().backward()
    scaled_dot_product_attention(*theirs).square().sum().backward()
    assert all(torch.allclose(a.grad, b.grad, atol=1e-5) for a, b in zip(ours, theirs, strict=True))


def test_attention_under_bfloat16_is_near_and_of_the_same_type():
    exact = attend(*make_heads(5, 6))
    with torch.autocast("cpu", dtype=torch.bfloat16):
        rough = attend(*(tensor.bfloat16() for tensor in make_heads(5, 6)))
    assert rough.dtype == torch.bfloat16
    assert torch.allclose(rough.float(), exact, atol=0.03)


def test_a_self_attention_block_has_the_parameters_of_its_layers_and_follows_the_order_of_its_tokens():
    torch.manual_seed(0)
    block = SelfAttentionBlock(size=16, heads=4, mlp_ratio=4)
    weights = 3 * 16 * 16 + 16 * 16 + 2 * 4 * 16 * 16
    biases = 3 * 16 + 16 + 4 * 16 + 16 + 4 * 16
    assert sum(parameter.numel() for parameter in block.parameters()) == weights + biases
    tokens, order = torch.randn(2, 7, 16), torch.randperm(7)
    assert torch.allclose(block(tokens)[:, order], block(tokens[:, order]), atol=1e-5)


def test_a_cross_attention_block_sees_its_context():
    torch.manual_seed(0)
    block, tokens, context = (
        CrossAttentionBlock(size=16, heads=4, mlp_ratio=2),
        torch.randn(2, 5, 16),
        torch.randn(2, 3, 16),
    )
    out = block(tokens, context)
    assert out.shape == tokens.shape
    changed = context.clone()
    changed[0] += torch.randn(3, 16)
    assert not torch.allclose(block(tokens, changed)[0], out[0])
    assert torch.equal(block(tokens, changed)[1], out[1])
