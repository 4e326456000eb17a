import pytest
import torch
from pydantic import ValidationError

from clutter6d.seeding import generator
from dapl_baselines.encoders.corn import CENTRE_M, SCALE_M, CornEncoder, CornEncoderConfig
from dapl_baselines.patches import TARGET, cut_target
from tests.dapl_baselines.cloud_fixtures import make_clouds, make_hands
from tests.dapl_baselines.policy.networks import count

SMALL = CornEncoderConfig(patch_hidden_size=16, token_size=16, heads=2)


def make_encoder(config: CornEncoderConfig = SMALL) -> CornEncoder:
    torch.manual_seed(0)
    return CornEncoder(config).eval()


def test_the_published_encoder_has_0_34_million_parameters():
    encoder = make_encoder(CornEncoderConfig())
    patches = (96 * 256 + 3 * 256) + (256 * 256 + 3 * 256) + 257 * 128
    places = (3 * 128 + 128) + 129 * 125
    block = 128 * 3 * 128 + 3 * 128 + 129 * 128 + 2 * 129 * 128 + 4 * 128
    assert count(encoder) == patches + places + 10 * 128 + 2 * block + 2 * 128 == 341_885
    assert (encoder.token_count, encoder.token_size) == (17, 128)


def test_patches_are_near_points_of_the_target_sorted_by_distance_from_the_centre():
    cloud = make_clouds(3)
    target = cloud[:, TARGET.of_cloud, :3]
    seen = make_encoder().see(target, cut_target(target))
    distances = seen.offsets.norm(dim=-1)
    assert torch.equal(seen.offsets[:, :, 0], torch.zeros(3, 16, 3))
    assert (distances.diff(dim=-1) >= 0).all()
    scaled = (target - torch.tensor(CENTRE_M)) / SCALE_M
    for row in range(3):
        for patch in range(16):
            nearest = (scaled[row] - seen.centres[row, patch]).norm(dim=-1).sort().values[:32]
            torch.testing.assert_close(distances[row, patch], nearest, atol=1e-6, rtol=0)


@torch.no_grad()
def test_the_order_of_the_targets_points_changes_nothing():
    encoder, cloud, hands = make_encoder(), make_clouds(2), make_hands(2)
    order = torch.arange(1280)
    order[TARGET.of_cloud] = torch.from_numpy(generator(1, "order").permutation(TARGET.points))
    torch.testing.assert_close(encoder(cloud[:, order], hands), encoder(cloud, hands))


@torch.no_grad()
def test_it_sees_the_targets_positions_and_the_hands_pose_and_nothing_else():
    encoder, cloud, hands = make_encoder(), make_clouds(2), make_hands(2)
    known, other = encoder(cloud, hands), cloud.clone()
    other[:, TARGET.points :] += 0.1
    other[:, :, 3:] += 0.1
    assert torch.equal(encoder(other, hands), known)
    other[:, 0, :3] += 0.01
    assert not torch.equal(encoder(other, hands), known)
    turned = hands.roll(1, dims=0)
    assert ((encoder(cloud, turned) - known).abs().amax(dim=-1) > 0).all()


@torch.no_grad()
def test_a_row_is_encoded_as_if_it_were_alone():
    encoder, cloud, hands = make_encoder(), make_clouds(7), make_hands(7)
    together = encoder(cloud, hands)
    for row in range(7):
        alone = encoder(cloud[row : row + 1], hands[row : row + 1])[0]
        torch.testing.assert_close(alone, together[row], atol=1e-5, rtol=1e-5)


def test_every_parameter_has_a_slope():
    encoder = make_encoder().train()
    tokens = encoder(make_clouds(2), make_hands(2))
    (tokens * torch.randn_like(tokens)).sum().backward()
    still = [name for name, parameter in encoder.named_parameters() if not parameter.grad.abs().sum() > 0]
    assert not still


def test_heads_must_divide_the_token():
    with pytest.raises(ValidationError, match="do not divide"):
        CornEncoderConfig(token_size=128, heads=7)
