import math

import numpy as np
import pytest
import torch

from dapl_baselines.patches import END_EFFECTOR, cut_into_patches
from dapl_baselines.tokenizer import Features, PatchTokenizer, gather_points, position_embedding
from tests.dapl_baselines.cloud_fixtures import make_clouds


def make_tokenizer(features: Features = "xyz_mass_velocity") -> PatchTokenizer:
    torch.manual_seed(0)
    tokenizer = PatchTokenizer(features, (16, 24), 128)
    tokenizer.update_statistics(make_clouds(4, seed=9))
    return tokenizer.eval()


def tokens_of(tokenizer: PatchTokenizer, cloud: torch.Tensor) -> torch.Tensor:
    with torch.no_grad():
        return tokenizer(cloud, cut_into_patches(cloud[..., :3]))


def test_a_token_is_the_maximum_over_its_points_projected_and_placed():
    tokenizer, cloud = make_tokenizer(), make_clouds(2)
    patches = cut_into_patches(cloud[..., :3])
    tokens = tokens_of(tokenizer, cloud)
    for row, patch in [(0, 0), (1, 17), (1, 39)]:
        points = cloud[row, patches.indices[row, patch]].clone()
        points[:, :3] -= patches.centres[row, patch]
        with torch.no_grad():
            embedded = tokenizer.point_layers((points - tokenizer.statistics.mean) / tokenizer.statistics.scale)
            expected = tokenizer.projection(embedded.max(dim=0).values)
        expected = expected + position_embedding(patches.centres[row, patch], 128)
        assert torch.allclose(tokens[row, patch], expected, atol=1e-5)


def test_points_are_gathered_for_each_patch_of_each_row():
    cloud = make_clouds(3)
    indices = cut_into_patches(cloud[..., :3]).indices
    gathered = gather_points(cloud, indices)
    assert all(torch.equal(gathered[row], cloud[row][indices[row]]) for row in range(3))


def test_object_tokens_do_not_change_when_only_the_end_effector_does():
    tokenizer, cloud = make_tokenizer(), make_clouds(3)
    other = cloud.clone()
    other[:, END_EFFECTOR.of_cloud] = make_clouds(3, seed=5)[:, END_EFFECTOR.of_cloud]
    before, after = tokens_of(tokenizer, cloud), tokens_of(tokenizer, other)
    assert torch.equal(before[:, :32], after[:, :32])
    assert not torch.equal(before[:, 32:], after[:, 32:])


@pytest.mark.parametrize(
    ("features", "unseen", "seen"),
    [("xyz", [3, 4, 5, 6], [0]), ("xyz_velocity", [3], [0, 4, 6]), ("xyz_mass_velocity", [], [0, 3, 4, 6])],
)
def test_only_the_chosen_features_are_seen(features, unseen, seen):
    tokenizer, cloud = make_tokenizer(features), make_clouds(1)
    before = tokens_of(tokenizer, cloud)
    other = cloud.clone()
    other[..., unseen] += 0.5
    assert torch.equal(tokens_of(tokenizer, other), before)
    for feature in seen:
        other = cloud.clone()
        other[..., feature] += 0.5
        assert not torch.equal(tokens_of(tokenizer, other), before)


def test_a_translation_of_everything_is_seen_by_the_position_alone():
    tokenizer, cloud, shift = make_tokenizer(), make_clouds(1), torch.tensor([0.25, -0.5, 0.125])
    centres = cut_into_patches(cloud[..., :3]).centres
    moved = cloud.clone()
    moved[..., :3] += shift
    expected = position_embedding(centres + shift, 128) - position_embedding(centres, 128)
    assert torch.allclose(tokens_of(tokenizer, moved) - tokens_of(tokenizer, cloud), expected, atol=1e-2)


def test_position_embedding_is_sines_and_cosines_of_every_axis_at_wavelengths_from_4_m_to_2_cm():
    position = torch.tensor([0.1, -0.2, 0.3])
    waves = [4.0 * (0.02 / 4.0) ** (step / 20) for step in range(21)]
    phases = [2 * math.pi * value / wave for value in position.tolist() for wave in waves]
    expected = np.concatenate([np.sin(phases), np.cos(phases), [0, 0]])
    assert np.allclose(position_embedding(position, 128).numpy(), expected, atol=1e-4)
