import numpy as np

from clutter6d.geometry import Pose, transform_points
from dapl_baselines.push_policy.target_shapes import CONTACTS, SURFACE_POINTS, TargetShapes
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
