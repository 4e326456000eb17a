"""Views of one asset, as an annotator is shown them."""

import io

import numpy as np
import pytest
from PIL import Image

from clutter6d.render.asset_picture import asset_views
from clutter6d.render.sheet import png_of
from tests.scene_fixtures import make_box_asset

ANGLES_DEG = ((140.0, -20.0), (20.0, -20.0), (140.0, -65.0))


@pytest.fixture(scope="module")
def views() -> tuple[np.ndarray, ...]:
    return asset_views(make_box_asset("box", (0.2, 0.1, 0.05)), ANGLES_DEG, size_px=64, backend="raycast")


def test_there_is_a_view_an_angle_and_each_is_another(views: tuple[np.ndarray, ...]) -> None:
    assert {view.shape for view in views} == {(64, 64, 3)}
    assert len({view.tobytes() for view in views}) == len(ANGLES_DEG)


def test_the_asset_fills_the_picture_and_does_not_leave_it(views: tuple[np.ndarray, ...]) -> None:
    for view in views:
        is_box = (view[..., 0].astype(int) - view[..., 2]) > 30
        assert 0.1 < is_box.mean() < 0.8
        assert not is_box[[0, -1]].any()
        assert not is_box[:, [0, -1]].any()


def test_the_same_asset_gives_the_same_bytes(views: tuple[np.ndarray, ...]) -> None:
    again = asset_views(make_box_asset("box", (0.2, 0.1, 0.05)), ANGLES_DEG, size_px=64, backend="raycast")
    assert [png_of(view) for view in again] == [png_of(view) for view in views]


def test_a_png_holds_the_picture(views: tuple[np.ndarray, ...]) -> None:
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(png_of(views[0])))), views[0])
