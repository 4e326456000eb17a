"""Difficulty: the fast figures agree with slow, independent ways of finding the same thing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from clutter6d.assets.asset import SymmetryGroup
from clutter6d.dataset.difficulty import (
    covered_share,
    gaps_m,
    path_gaps_m,
    symmetric_tilt_rad,
    tilt_rad,
)
from clutter6d.dataset.measurement import Measurements, measure
from clutter6d.geometry import (
    quat_from_axis_angle,
    quat_from_yaw,
    quat_multiply,
    quat_normalize,
    rotation_error_rad,
    transform_points,
)
from clutter6d.scenegen.footprint import Layout, footprint_supports, hull_points, separations_m
from clutter6d.scenegen.generation import generate_scenes, open_for_generation
from clutter6d.scenegen.scene_set import SceneSet
from clutter6d.scenegen.track import Region, find_track
from clutter6d.seeding import generator
from tests.box_library import make_box_library
from tests.scene_fixtures import make_box_asset, make_box_scene_set

seeds = st.integers(0, 10_000)
angles = st.floats(-3.1, 3.1)
TURNS = np.linspace(-np.pi, np.pi, 721)


def quat(seed: int) -> np.ndarray:
    return quat_normalize(generator(seed, "quat").normal(size=(1, 4)))


def yawed(quats: np.ndarray) -> np.ndarray:
    """All rotations that a push along the table can make of each."""
    return quat_multiply(quat_from_yaw(TURNS)[:, None], quats[None])


@pytest.fixture(scope="module")
def scene_set(tmp_path_factory: pytest.TempPathFactory) -> SceneSet:
    """Two generated moderate scenes of boxes: 32 goal pairs."""
    path, track = tmp_path_factory.mktemp("difficulty"), find_track("moderate")
    library = make_box_library(path / "library")
    made = open_for_generation(library, track, 3, path / "scenes")
    assert len(list(generate_scenes(library, track, 3, made, range(2)))) == 2
    return SceneSet.open(made.path)


@pytest.fixture(scope="module")
def measured(scene_set: SceneSet) -> Measurements:
    return measure(scene_set)


@given(seed=seeds, yaw=angles)
def test_a_turn_on_the_table_has_no_tilt(seed: int, yaw: float) -> None:
    assert tilt_rad(quat(seed), quat_multiply(quat_from_yaw(np.array([yaw])), quat(seed)))[0] < 1e-6


@given(first=seeds, second=seeds)
def test_tilt_is_what_no_turn_on_the_table_can_undo(first: int, second: int) -> None:
    left = rotation_error_rad(yawed(quat(first)), quat(second)[None]).min()
    assert tilt_rad(quat(first), quat(second))[0] == pytest.approx(left, abs=0.01)


@given(first=seeds, second=seeds, axis=seeds, fold=st.sampled_from([1, 2, 4]))
def test_symmetric_tilt_is_the_least_over_all_goals_that_look_alike(
    first: int, second: int, axis: int, fold: int
) -> None:
    direction = quat(axis)[0, 1:] / np.linalg.norm(quat(axis)[0, 1:])
    discrete = quat_from_axis_angle(direction[None], 2 * np.pi * np.arange(fold) / fold)
    found = symmetric_tilt_rad(
        quat(first), quat(second), SymmetryGroup(discrete_quats_wxyz=discrete, continuous_axis=None)
    )
    alike = quat_multiply(quat(second), discrete)
    least = min(rotation_error_rad(yawed(quat(first)), goal[None, None]).min() for goal in alike)
    assert found[0] == pytest.approx(least, abs=0.01)


@given(first=seeds, second=seeds, axis=seeds)
def test_a_continuous_symmetry_lets_the_object_roll(first: int, second: int, axis: int) -> None:
    x, y, z = (float(value) for value in quat(axis)[0, 1:] / np.linalg.norm(quat(axis)[0, 1:]))
    across = np.cross([x, y, z], [0.3, -0.5, 0.8])
    flip = quat_from_axis_angle(across / np.linalg.norm(across), np.pi)
    symmetry = SymmetryGroup(discrete_quats_wxyz=np.stack([np.array([1.0, 0, 0, 0]), flip]), continuous_axis=(x, y, z))
    rolled = quat_from_axis_angle(np.array([[x, y, z]]), TURNS)
    alike = np.concatenate(
        [quat_multiply(quat(second), rolled), quat_multiply(quat_multiply(quat(second), flip), rolled)]
    )
    least = tilt_rad(np.repeat(quat(first), len(alike), axis=0), alike).min()
    assert symmetric_tilt_rad(quat(first), quat(second), symmetry)[0] == pytest.approx(least, abs=0.01)


def test_gaps_are_those_of_the_generator(scene_set: SceneSet) -> None:
    scene = scene_set.scenes[0]
    assets, poses = scene_set.assets_of(scene), scene.goal_pairs[0].object_poses
    supports = np.concatenate(
        [
            footprint_supports(hull_points(assets[item.asset_hash]), poses[index, None, 3:])[0]
            for index, item in enumerate(scene.objects)
        ]
    )
    rest = Layout(names=("",) * 7, positions=poses[1:, :2], supports=supports[1:], tops=np.zeros(7))
    ours = gaps_m(poses[:1, :2], supports[:1], poses[None, 1:, :2], supports[None, 1:])
    np.testing.assert_array_equal(ours, separations_m(poses[:1, :2], supports[:1], rest))


def test_blocked_paths_are_those_on_which_a_slowly_moved_shadow_meets_an_obstacle(
    scene_set: SceneSet, measured: Measurements
) -> None:
    """Independent of support functions: points in the target's shadow, moved in small steps, in obstacles' polygons."""
    rows = iter(measured.pairs.itertuples())
    decided = 0
    for scene in scene_set.scenes:
        assets = scene_set.assets_of(scene)
        hulls = [hull_points(assets[item.asset_hash]) for item in scene.objects]
        for number, pair in enumerate(scene.goal_pairs):
            row = next(rows)
            if number % 2:
                continue
            shadows = [transform_points(pose, hull)[:, :2] for pose, hull in zip(pair.object_poses, hulls, strict=True)]
            depth = deepest_meeting_m(
                shadows[0], np.subtract(pair.goal.position, pair.initial.position)[:2], shadows[1:]
            )
            assert row.is_blocked == (row.is_blocked_by_large or row.is_blocked_by_small)
            if depth > 0.002 or depth < -0.01:  # a near miss counts as blocked
                decided += 1
                assert row.is_blocked == (depth > 0)
    assert decided >= 10


def deepest_meeting_m(moved: np.ndarray, offset: np.ndarray, obstacles: list[np.ndarray]) -> float:
    """How deep a shadow gets into any polygon when moved by an offset in steps of 2 mm; negative if it stays away."""
    corners = moved[ConvexHull(moved).vertices]
    shares = np.linspace(0, 1, 40)[:, None, None]
    border = ((1 - shares) * corners + shares * np.roll(corners, -1, axis=0)).reshape(-1, 2)
    filled = np.concatenate([corners.mean(axis=0) + scale * (border - corners.mean(axis=0)) for scale in (1, 0.6, 0.2)])
    steps = np.linspace(0, 1, int(np.linalg.norm(offset) / 0.002))[:, None, None] * offset
    path = (filled + steps).reshape(-1, 2)
    depths = []
    for obstacle in obstacles:
        planes = ConvexHull(obstacle).equations
        depths.append((-(path @ planes[:, :2].T + planes[:, 2]).max(axis=1)).max())
    return float(max(depths))


def test_a_covered_share_is_an_area(scene_set: SceneSet) -> None:
    box = make_box_asset("box", (0.2, 0.1, 0.06))
    supports, _ = footprint_supports(hull_points(box), np.array([[1.0, 0, 0, 0]] * 2))
    region = Region(x=(-0.2, 0.2), y=(-0.2, 0.2))
    inside = covered_share(np.array([[0.0, 0.0], [0.0, 0.15]]), supports, region)
    assert inside == pytest.approx(2 * 0.2 * 0.1 / 0.16, abs=0.02)
    half_out = covered_share(np.array([[0.2, 0.0]]), supports[:1], region)
    assert half_out == pytest.approx(0.5 * 0.2 * 0.1 / 0.16, abs=0.02)


def test_a_path_is_blocked_by_what_stands_in_it_and_not_by_what_stands_beside_it() -> None:
    box = make_box_asset("box", (0.1, 0.1, 0.1))
    support, _ = footprint_supports(hull_points(box), np.array([[1.0, 0, 0, 0]]))
    start, end = np.array([[0.0, -0.3]]), np.array([[0.0, 0.3]])
    others = np.array([[[0.0, 0.0], [0.13, 0.0]]])
    gaps = path_gaps_m(start, end, support, others, np.repeat(support[None], 2, axis=1))
    assert gaps[0, 0] < 0
    assert gaps[0, 1] == pytest.approx(0.03, abs=1e-6)


def test_every_goal_pair_object_and_scene_has_its_row(scene_set: SceneSet, measured: Measurements) -> None:
    assert (len(measured.pairs), len(measured.objects), len(measured.scenes)) == (32, 16, 2)
    assert measured.pairs["start_gap_m"].min() > 0.004
    assert measured.objects.loc[measured.objects["role"] == "target", ["gap_m", "mass_ratio"]].isna().all(axis=None)
    assert measured.scenes["covered_share"].between(0.05, 0.6).all()


def test_a_slide_is_planar_and_laying_down_is_not() -> None:
    pairs = measure(make_box_scene_set(1)).pairs
    assert pairs["is_planar"].tolist() == [True, False]
    assert pairs["tilt_rad"].tolist() == pytest.approx([0, np.pi / 2], abs=1e-9)
    assert pairs["is_easy"].tolist() == [True, False]


def test_a_half_turn_upside_down_is_planar_for_a_box_up_to_its_symmetry() -> None:
    upright, flipped = np.array([[1.0, 0, 0, 0]]), np.array([[0.0, 1.0, 0, 0]])
    box = make_box_asset("box", (0.2, 0.1, 0.06))
    assert tilt_rad(upright, flipped)[0] == pytest.approx(np.pi)
    assert symmetric_tilt_rad(upright, flipped, box.symmetry)[0] == pytest.approx(0)


def test_progress_is_told_of_every_scene() -> None:
    seen: list[tuple[int, int]] = []
    measure(make_box_scene_set(3), lambda done, total: seen.append((done, total)))
    assert seen == [(1, 3), (2, 3), (3, 3)]
