import torch

from dapl_baselines.policy.frame_attention import FrameAttention, features_of, make_frames
from tests.dapl_baselines.policy.networks import count


def make_attention(history: int, size: int = 8) -> FrameAttention:
    with torch.random.fork_rng():
        torch.manual_seed(0)
        return FrameAttention(size, history)


def make_window(rows: int, history: int, size: int = 8) -> torch.Tensor:
    generator = torch.Generator().manual_seed(1)
    return make_frames(torch.randn(rows * history, size, generator=generator)).unflatten(0, (rows, history))


def test_its_parameters_are_those_of_a_block_and_one_embedding_an_age():
    history, d = 4, 128
    attention, norms, mlp = 4 * (d + 1) * d, 3 * 2 * d, (d + 1) * 2 * d + (2 * d + 1) * d
    assert count(FrameAttention(d, history)) == history * d + attention + norms + mlp == 133_248


def test_a_frame_says_that_it_is_there():
    features = torch.randn(3, 8)
    assert torch.equal(features_of(make_frames(features)), features)
    assert make_frames(features)[:, -1].tolist() == [1, 1, 1]


@torch.no_grad()
def test_every_frame_that_is_there_counts_and_so_does_its_age():
    attend, window = make_attention(4), make_window(2, 4)
    fused = attend(window)
    assert fused.shape == (2, 8)
    for frame in range(4):
        changed = window.clone()
        changed[0, frame, 0] += 1
        assert not torch.allclose(attend(changed)[0], fused[0])
        assert torch.equal(attend(changed)[1], fused[1])
    assert not torch.allclose(attend(window[:, [1, 0, 2, 3]]), fused)


def test_frames_before_the_start_count_for_nothing():
    attend, window = make_attention(3), make_window(2, 3)
    window[0, :2] = 0
    other = window.clone().requires_grad_()
    with torch.no_grad():
        other[0, :2, :-1] = 1e3
    assert torch.equal(attend(other), attend(window))
    attend(other).square().sum().backward()
    assert not other.grad[0, :2].any()
    assert other.grad[1, :2].any()
