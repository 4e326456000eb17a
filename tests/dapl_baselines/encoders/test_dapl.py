import pytest
import torch
from pydantic import ValidationError

from clutter6d.seeding import generator
from dapl_baselines.encoders.dapl import DaplEncoder, DaplEncoderConfig
from dapl_baselines.patches import COMPONENTS
from tests.dapl_baselines.cloud_fixtures import make_clouds, make_hands

SMALL = DaplEncoderConfig(token_size=32, blocks=2, heads=4, patch_hidden_sizes=(8, 16))


def make_encoder(config: DaplEncoderConfig = SMALL) -> DaplEncoder:
    torch.manual_seed(0)
    encoder = DaplEncoder(config)
    encoder.update_statistics(make_clouds(4, seed=9))
    return encoder.eval()


def tokens_of(encoder: DaplEncoder, cloud: torch.Tensor) -> torch.Tensor:
    return encoder(cloud, make_hands(len(cloud)))


def count(module: torch.nn.Module) -> int:
    return sum(parameter.numel() for parameter in module.parameters())


def test_the_papers_encoder_has_2_38_million_parameters_in_its_transformer():
    encoder = DaplEncoder(DaplEncoderConfig())
    assert count(encoder.blocks) == 12 * 198_272 == 2_379_264
    assert count(encoder.tokenizer) == (7 * 64 + 64) + (64 * 64 + 64) + (64 * 128 + 128)
    assert count(encoder) == 2_379_264 + count(encoder.tokenizer) + 256
    assert (encoder.token_count, encoder.token_size) == (40, 128)


def test_the_papers_encoder_gives_40_tokens_of_128_numbers():
    with torch.inference_mode():
        tokens = tokens_of(DaplEncoder(DaplEncoderConfig()).eval(), make_clouds(2))
    assert tokens.shape == (2, 40, 128)
    assert torch.isfinite(tokens).all()


def test_shuffling_points_inside_a_component_changes_nothing():
    encoder, cloud = make_encoder(), make_clouds(2)
    order = torch.arange(1280)
    for component in COMPONENTS:
        shuffled = generator(1, "order").permutation(component.points)
        order[component.of_cloud] = component.start + torch.from_numpy(shuffled)
    with torch.no_grad():
        assert torch.allclose(tokens_of(encoder, cloud[:, order]), tokens_of(encoder, cloud), atol=1e-5)


def test_a_row_is_encoded_as_if_it_were_alone():
    encoder, cloud = make_encoder(), make_clouds(70)
    with torch.no_grad():
        together = tokens_of(encoder, cloud)
        for row in (0, 31, 32, 69):
            assert torch.allclose(tokens_of(encoder, cloud[row : row + 1])[0], together[row], atol=1e-5)


def test_tokens_attend_to_one_another():
    encoder, cloud = make_encoder(), make_clouds(1)
    other = cloud.clone()
    other[:, 1024:, 4:] += 0.3
    with torch.no_grad():
        change = (tokens_of(encoder, other) - tokens_of(encoder, cloud)).abs().amax(dim=(0, 2))
    assert (change > 0).all()


def test_every_parameter_has_a_slope():
    encoder = make_encoder().train()
    tokens = tokens_of(encoder, make_clouds(2))
    (tokens * torch.randn_like(tokens)).sum().backward()
    still = [name for name, parameter in encoder.named_parameters() if not parameter.grad.abs().sum() > 0]
    assert not still


def test_bfloat16_is_near_float32():
    encoder, cloud = make_encoder(), make_clouds(4)
    with torch.inference_mode():
        exact = tokens_of(encoder, cloud)
        with torch.autocast("cpu", dtype=torch.bfloat16):
            rough = tokens_of(encoder, cloud)
    assert (rough - exact).abs().mean() < 0.01 * exact.abs().mean() + 0.01


def test_statistics_change_only_when_asked_and_only_in_training():
    encoder, cloud = make_encoder(), make_clouds(2)
    before = encoder.tokenizer.statistics.mean.clone()
    tokens_of(encoder.train(), cloud)
    encoder.eval().update_statistics(cloud)
    assert torch.equal(encoder.tokenizer.statistics.mean, before)
    encoder.train().update_statistics(cloud)
    assert not torch.equal(encoder.tokenizer.statistics.mean, before)


def test_heads_must_divide_the_token():
    with pytest.raises(ValidationError, match="do not divide"):
        DaplEncoderConfig(token_size=128, heads=7)
