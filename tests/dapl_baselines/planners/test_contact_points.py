import dataclasses

import numpy as np

from clutter6d.assets.asset import Mesh
from dapl_baselines.planners.contact_points import sample_contact_points
from tests.scene_fixtures import make_box_asset

SIZE_M = np.array([0.06, 0.09, 0.14])


def test_points_lie_on_the_surface_and_normals_point_outward():
    contacts = sample_contact_points(make_box_asset("box", tuple(SIZE_M)))
    scaled = np.abs(contacts.points) / (SIZE_M / 2)
    np.testing.assert_allclose(scaled.max(axis=1), 1.0, atol=1e-5)
    axis = scaled.argmax(axis=1)
    facing = contacts.normals[np.arange(len(axis)), axis] * np.sign(contacts.points[np.arange(len(axis)), axis])
    np.testing.assert_allclose(facing, 1.0, atol=1e-6)


def test_every_face_is_covered_in_proportion_to_its_area():
    contacts = sample_contact_points(make_box_asset("box", tuple(SIZE_M)))
    share = (np.abs(contacts.normals) > 0.9).mean(axis=0)
    area = np.array([SIZE_M[1] * SIZE_M[2], SIZE_M[0] * SIZE_M[2], SIZE_M[0] * SIZE_M[1]])
    np.testing.assert_allclose(share, area / area.sum(), atol=0.1)


def test_points_inside_another_part_are_left_out():
    whole = make_box_asset("box", (0.1, 0.1, 0.1))
    left, right = (
        Mesh(vertices=(whole.parts[0].vertices + np.float32([shift, 0, 0])), faces=whole.parts[0].faces)
        for shift in (-0.02, 0.02)
    )
    contacts = sample_contact_points(dataclasses.replace(whole, parts=(left, right)))
    inside = np.abs(np.abs(contacts.points[:, 0]) - 0.03) < 1e-6
    assert not inside.any()


def test_the_same_asset_gives_the_same_points():
    first, second = (sample_contact_points(make_box_asset("box", (0.1, 0.1, 0.1))) for _ in range(2))
    np.testing.assert_array_equal(first.points, second.points)
