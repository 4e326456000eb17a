"""Footprints: the separation never claims more free distance than there is."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from clutter6d.geometry import quat_from_yaw
from clutter6d.scenegen.footprint import (
    DIRECTIONS,
    Layout,
    empty_layout,
    footprint_supports,
    hull_points,
    separations_m,
    swept_support,
)
from clutter6d.seeding import generator
from tests.scene_fixtures import make_box_asset

seeds = st.integers(0, 10_000)


def polygon(seed: int) -> np.ndarray:
    points = generator(seed, "polygon").normal(scale=0.05, size=(12, 2))
    return points[ConvexHull(points).vertices]


def support(points: np.ndarray) -> np.ndarray:
    return (points @ DIRECTIONS.T).max(axis=0)


def one_object(points: np.ndarray) -> Layout:
    return empty_layout().with_object("obstacle", np.zeros(2), support(points), 0.1)


def true_distance(first: np.ndarray, second: np.ndarray) -> float:
    """Distance of two polygons that are apart, over densely sampled edges."""

    def sampled(points: np.ndarray) -> np.ndarray:
        share = np.linspace(0, 1, 60)[:, None, None]
        return ((1 - share) * points + share * np.roll(points, -1, axis=0)).reshape(-1, 2)

    return float(np.linalg.norm(sampled(first)[:, None] - sampled(second)[None], axis=-1).min())


@given(first=seeds, second=seeds, angle=st.floats(0, 2 * np.pi), distance=st.floats(0.0, 0.6))
def test_separation_is_a_lower_bound_of_the_distance(first: int, second: int, angle: float, distance: float) -> None:
    moved = distance * np.array([np.cos(angle), np.sin(angle)])
    gap = separations_m(moved[None], support(polygon(second))[None], one_object(polygon(first)))[0, 0]
    if gap > 0:
        assert gap <= true_distance(polygon(first), polygon(second) + moved) + 1e-4


@given(first=seeds, second=seeds, angle=st.floats(0, 2 * np.pi))
def test_far_apart_footprints_are_free(first: int, second: int, angle: float) -> None:
    moved = 0.8 * np.array([np.cos(angle), np.sin(angle)])
    assert separations_m(moved[None], support(polygon(second))[None], one_object(polygon(first)))[0, 0] > 0.1


@given(first=seeds, second=seeds)
def test_concentric_footprints_overlap(first: int, second: int) -> None:
    centred = polygon(second) - polygon(second).mean(axis=0) + polygon(first).mean(axis=0)
    assert separations_m(np.zeros((1, 2)), support(centred)[None], one_object(polygon(first)))[0, 0] < 0


def test_a_turned_box_has_the_footprint_of_a_turned_rectangle() -> None:
    box = make_box_asset("box", (0.2, 0.1, 0.06))
    supports, spans = footprint_supports(hull_points(box), quat_from_yaw(np.array([0.0, np.pi / 2])))
    np.testing.assert_allclose(supports[0, [0, 16]], [0.1, 0.05], atol=1e-8)
    np.testing.assert_allclose(supports[1, [0, 16]], [0.05, 0.1], atol=1e-8)
    np.testing.assert_allclose(spans, [[-0.03, 0.03]] * 2, atol=1e-8)


def test_a_pushed_footprint_sweeps_what_lies_between() -> None:
    block = support(0.05 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]))
    swept = swept_support(np.array([-0.4, 0.0]), np.array([0.4, 0.0]), block)
    assert separations_m(np.zeros((1, 2)), swept[None], one_object(polygon(1)))[0, 0] < 0
    beside = swept_support(np.array([-0.4, 0.5]), np.array([0.4, 0.5]), block)
    assert separations_m(np.zeros((1, 2)), beside[None], one_object(polygon(1)))[0, 0] > 0
