import torch

from dapl_baselines.patches import cut_into_patches
from dapl_baselines.world_model.unpatchify import Unpatchify, nearest_patches, scatter_mean
from tests.dapl_baselines.cloud_fixtures import make_clouds


def test_a_point_gets_the_mean_over_all_places_that_hold_it():
    torch.manual_seed(0)
    indices, values = torch.randint(12, (3, 4, 5)), torch.randn(3, 4, 5, 2)
    means, is_covered = scatter_mean(values, indices, 12)
    for row in range(3):
        for point in range(12):
            places = [values[row, i, j] for i in range(4) for j in range(5) if indices[row, i, j] == point]
            expected = torch.stack(places).mean(dim=0) if places else torch.zeros(2)
            assert torch.allclose(means[row, point], expected, atol=1e-6)
            assert bool(is_covered[row, point]) == bool(places)


def test_means_are_float32_whatever_goes_in():
    means, _ = scatter_mean(torch.ones(1, 1, 3, 2, dtype=torch.bfloat16), torch.tensor([[[0, 0, 1]]]), 4)
    assert means.dtype == torch.float32
    assert torch.equal(means[0, :, 0], torch.tensor([1.0, 1.0, 0.0, 0.0]))


def test_the_nearest_patch_is_of_the_points_own_component():
    cloud = make_clouds(2)
    centres = cut_into_patches(cloud[..., :3]).centres
    nearest = nearest_patches(cloud[..., :3], centres)
    for point, first, last in [(0, 0, 16), (511, 0, 16), (512, 16, 32), (1023, 16, 32), (1024, 32, 40), (1279, 32, 40)]:
        for row in range(2):
            distances = (centres[row, first:last] - cloud[row, point, :3]).norm(dim=-1)
            assert int(nearest[row, point]) == first + int(distances.argmin())


def test_every_point_gets_its_patches_embedding_and_its_offsets():
    torch.manual_seed(0)
    unpatchify, cloud, tokens = Unpatchify(size=8, hidden_size=16), make_clouds(2), torch.randn(2, 40, 8)
    patches = cut_into_patches(cloud[..., :3])
    with torch.no_grad():
        points = unpatchify(tokens, patches, cloud[..., :3])
    nearest = nearest_patches(cloud[..., :3], patches.centres)
    uncovered = 0
    for row, point in [(row, point) for row in range(2) for point in range(0, 1280, 37)]:
        holders = (patches.indices[row] == point).any(dim=1).nonzero()[:, 0].tolist()
        uncovered += not holders
        holders = holders or [int(nearest[row, point])]
        offsets = cloud[row, point, :3] - patches.centres[row, holders]
        with torch.no_grad():
            expected = (tokens[row, holders] + unpatchify.offset_embedding(offsets / 0.01)).mean(dim=0)
        assert torch.allclose(points[row, point], expected, atol=1e-5)
    assert 5 < uncovered < 60
