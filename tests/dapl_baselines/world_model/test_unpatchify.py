import torch

from dapl_baselines.patches import cut_into_patches
from dapl_baselines.world_model.unpatchify import Unpatchify, find_places, nearest_patches, scatter_mean
from tests.dapl_baselines.cloud_fixtures import make_clouds


def test_a_point_gets_the_mean_over_all_places_that_hold_it():
    torch.manual_seed(0)
    indices, values = torch.randint(30, (40,)), torch.randn(40, 2)
    means = scatter_mean(values, indices, 30)
    for point in range(30):
        places = [values[place] for place in range(40) if indices[place] == point]
        expected = torch.stack(places).mean(dim=0) if places else torch.zeros(2)
        assert torch.allclose(means[point], expected, atol=1e-6)


def test_means_are_float32_whatever_goes_in():
    means = scatter_mean(torch.ones(3, 2, dtype=torch.bfloat16), torch.tensor([0, 0, 1]), 3)
    assert means.dtype == torch.float32
    assert torch.equal(means[:, 0], torch.tensor([1.0, 1.0, 0.0]))


def test_every_point_has_a_place_in_its_own_row():
    cloud = make_clouds(3)
    patches = cut_into_patches(cloud[..., :3])
    places = find_places(patches, cloud[..., :3])
    assert set(places.points.tolist()) == set(range(3 * 1280))
    assert torch.equal(places.points // 1280, places.patches // 40)
    in_patches = places.points[: 3 * 1280].reshape(3, 40, 32) - 1280 * torch.arange(3)[:, None, None]
    assert torch.equal(in_patches, patches.indices)


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
            embedded = unpatchify.offset_output(unpatchify.offset_layers(offsets / 0.01))
            expected = (tokens[row, holders] + embedded).mean(dim=0)
        assert torch.allclose(points[row, point], expected, atol=1e-5)
    assert 5 < uncovered < 60
