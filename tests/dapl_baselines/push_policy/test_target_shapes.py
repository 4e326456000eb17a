import numpy as np

from clutter6d.geometry import Pose, transform_points
from clutter6d.seeding import generator
from dapl_baselines.push_policy.target_shapes import CONTACTS, SURFACE_POINTS, TargetShapes, outermost
from tests.scene_fixtures import make_box_asset

CUBE, FLAT = make_box_asset("cube", (0.1, 0.1, 0.1)), make_box_asset("flat", (0.2, 0.2, 0.02))


def test_shapes_do_not_depend_on_the_order_of_assets_or_on_how_often_they_come():
    one, other = TargetShapes.of([CUBE, FLAT]), TargetShapes.of([FLAT, CUBE, FLAT])
    assert one.index == other.index
    for name in ("contacts", "normals", "surface"):
        assert np.array_equal(getattr(one, name), getattr(other, name))


def test_each_asset_has_the_row_of_its_shape():
    shapes = TargetShapes.of([CUBE, FLAT])
    rows = shapes.rows_of([FLAT, CUBE, FLAT])
    assert shapes.contacts.shape == (2, CONTACTS, 3)
    assert shapes.surface.shape == (2, SURFACE_POINTS, 3)
    for row, asset in zip(rows, [FLAT, CUBE, FLAT], strict=True):
        half = np.array(asset.extents_m) / 2
        touched = np.abs(shapes.contacts[row]) / half
        np.testing.assert_allclose(touched.max(axis=1), 1.0, atol=1e-6)
        np.testing.assert_allclose(np.abs(shapes.surface[row] / half).max(axis=1), 1.0, atol=1e-5)
        assert ((shapes.contacts[row] * shapes.normals[row]).sum(axis=1) > 0).all()


def test_contacts_are_placed_with_their_targets():
    shapes = TargetShapes.of([CUBE, FLAT])
    poses = np.stack([Pose(position=(0.1, 0.2, 0.3), quat_wxyz=(0.5, 0.5, 0.5, 0.5)).as_row()] * 2)
    placed = shapes.placed_contacts(np.array([1, 0]), poses)
    np.testing.assert_array_equal(placed[0], transform_points(poses[:1], shapes.contacts[[1]])[0])


def test_the_outermost_points_are_as_far_out_as_any_in_all_directions():
    rng = generator(0, "outermost")
    points, ways = rng.normal(size=(3, 512, 3)) * [0.1, 0.05, 0.02], rng.normal(size=(100, 3))
    found = outermost(points)
    assert found.shape == (3, SURFACE_POINTS, 3)
    reach, all_reach = (found @ ways.T).max(axis=1), (points @ ways.T).max(axis=1)
    assert (reach <= all_reach + 1e-6).all()
    assert (reach / all_reach).mean() > 0.95
    for cloud, kept in zip(points.astype(np.float32), found, strict=True):
        assert (kept[:, None] == cloud).all(axis=-1).any(axis=1).all()


def test_a_box_is_known_by_its_corners():
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * [0.1, 0.2, 0.05]
    inside = generator(0, "inside").uniform(-0.9, 0.9, (500, 3)) * [0.1, 0.2, 0.05]
    found = outermost(np.concatenate([inside, corners])[None])[0]
    assert len(np.unique(found, axis=0)) == 8
