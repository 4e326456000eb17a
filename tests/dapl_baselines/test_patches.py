import numpy as np
import pytest
import torch

from clutter6d.seeding import generator
from dapl_baselines.patch_kernel import compiled_patches
from dapl_baselines.patches import COMPONENTS, PATCH_POINTS, cut_into_patches, farthest_points, readable_patches
from tests.dapl_baselines.cloud_fixtures import make_clouds

PARTS = [(slice(0, 512), slice(0, 16)), (slice(512, 1024), slice(16, 32)), (slice(1024, 1280), slice(32, 40))]


def farthest_by_loops(points: np.ndarray, count: int) -> list[int]:
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    chosen = [int(np.argmax(((points - middle) ** 2).sum(axis=1)))]
    while len(chosen) < count:
        distances = [((points - points[index]) ** 2).sum(axis=1) for index in chosen]
        chosen.append(int(np.argmax(np.min(distances, axis=0))))
    return chosen


def sets_of(indices) -> list[set[int]]:
    return [set(patch) for patch in indices.tolist()]


def test_patches_are_farthest_points_and_their_nearest_neighbours_in_their_own_component():
    cloud = make_clouds(2)
    patches = cut_into_patches(cloud[..., :3])
    for row in range(2):
        for points, own in PARTS:
            positions = cloud[row, points, :3].double().numpy()
            indices = patches.indices[row, own].numpy() - points.start
            assert indices[:, 0].tolist() == farthest_by_loops(positions, len(indices))
            for patch in indices:
                distances = ((positions - positions[patch[0]]) ** 2).sum(axis=1)
                assert set(patch.tolist()) == set(np.argsort(distances)[:PATCH_POINTS].tolist())


def test_centres_are_points_of_the_cloud():
    cloud = make_clouds(3)
    patches = cut_into_patches(cloud[..., :3])
    rows = torch.arange(3)[:, None]
    assert torch.equal(patches.centres, cloud[rows, patches.indices[..., 0], :3])


@pytest.mark.parametrize(("points", "patches"), [(512, 16), (256, 8)])
def test_compiled_and_readable_patches_hold_the_same_points(points, patches):
    positions = make_clouds(9)[:, :points, :3].contiguous()
    readable = readable_patches(positions, patches)
    for threads in (1, 2):
        compiled = compiled_patches(positions.numpy(), patches, PATCH_POINTS, threads)
        assert np.array_equal(compiled[..., 0], readable[..., 0])
        assert np.array_equal(np.sort(compiled), np.sort(readable))


@pytest.mark.parametrize("positions", [np.zeros((1, 512, 3)), np.full((1, 512, 3), np.nan), np.ones((0, 512, 3))])
def test_clouds_without_extent_have_patches_of_points_that_exist(positions):
    positions = positions.astype(np.float32)
    for indices in (
        compiled_patches(positions, 16, PATCH_POINTS, 1),
        readable_patches(torch.from_numpy(positions), 16).numpy(),
    ):
        assert indices.shape == (len(positions), 16, PATCH_POINTS)
        assert ((indices >= 0) & (indices < 512)).all()


def test_coinciding_points_are_all_in_a_patch_once():
    positions = make_clouds(1)[:, :512, :3].contiguous()
    positions[:, :40] = positions[:, :1]
    for indices in (
        compiled_patches(positions.numpy(), 16, PATCH_POINTS, 1)[0],
        readable_patches(positions, 16)[0].numpy(),
    ):
        assert all(len(patch) == PATCH_POINTS for patch in sets_of(indices))


def test_the_order_of_points_inside_a_component_does_not_change_the_patches():
    cloud = make_clouds(2)
    before = cut_into_patches(cloud[..., :3])
    order = torch.arange(1280)
    for component in COMPONENTS:
        shuffled = generator(0, "order").permutation(component.points)
        order[component.of_cloud] = component.start + torch.from_numpy(shuffled)
    after = cut_into_patches(cloud[:, order, :3])
    assert torch.equal(after.centres, before.centres)
    for row in range(2):
        assert sets_of(order[after.indices[row]]) == sets_of(before.indices[row])


def test_a_clouds_patches_do_not_depend_on_the_other_rows():
    cloud = make_clouds(11)
    together = cut_into_patches(cloud[..., :3])
    for row in range(11):
        alone = cut_into_patches(cloud[row : row + 1, :, :3])
        assert torch.equal(alone.indices[0], together.indices[row])


def test_farthest_points_come_with_their_distances_to_all_points():
    positions = make_clouds(2)[:, :256, :3]
    indices, squared = farthest_points(positions, 8)
    chosen = positions.gather(1, indices[..., None].expand(-1, -1, 3))
    assert torch.allclose(squared, (chosen[:, :, None] - positions[:, None]).square().sum(dim=-1))
