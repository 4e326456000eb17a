import numpy as np
import pytest
import torch

from clutter6d.geometry import quat_from_yaw, quat_multiply, quat_to_matrix, transform_points
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.push_frame import PushView, feature_count, push_axes, view_pushes
from dapl_baselines.push_policy.push_state import STATE_FIELDS, PushState
from dapl_baselines.push_policy.target_shapes import SURFACE_POINTS
from dapl_baselines.teacher.transitions import mirrored
from tests.dapl_baselines.push_policy.drawn import BOX, draw_goals, draw_pushes, draw_state, make_push, surface
from tests.dapl_baselines.teacher.stories import draw_transitions

ROWS = 6
PLACE_FEATURES = 9
"""The robot's base, where it starts, where the target is and shall be: what a place on the table changes."""


def view(state: PushState[np.ndarray], goals: np.ndarray, pushes: np.ndarray, side: int = 1) -> PushView:
    """In double precision, so that what should be equal is; ``side`` -1: of the mirrored box."""
    in_doubles = PushState(**{name: torch.from_numpy(getattr(state, name)) for name in STATE_FIELDS})
    points = torch.from_numpy(surface(len(goals)).astype(np.float64) * [1, side, 1])
    return view_pushes(in_doubles, torch.from_numpy(goals), points, torch.from_numpy(pushes))


def turned(state: PushState[np.ndarray], goals: np.ndarray, pushes: np.ndarray, yaw: float):
    """The same in a world turned about the vertical."""
    quat = quat_from_yaw(yaw)
    matrix = quat_to_matrix(quat)

    def vectors(array: np.ndarray) -> np.ndarray:
        return array @ matrix.T

    def poses(rows: np.ndarray) -> np.ndarray:
        return np.hstack([vectors(rows[:, :3]), quat_multiply(quat, rows[:, 3:])])

    moved = pushes.copy()
    for part in columns.VECTORS:
        moved[..., part] = vectors(pushes[..., part])
    moved[..., columns.HAND] = quat_multiply(quat, pushes[..., columns.HAND])
    other = PushState(
        poses=poses(state.poses),
        velocities=np.hstack([vectors(state.velocities[:, :3]), vectors(state.velocities[:, 3:])]),
        obstacles=np.concatenate([vectors(state.obstacles[..., :3]), state.obstacles[..., 3:]], axis=-1),
        physics=state.physics,
        tips=vectors(state.tips),
        tip_velocities=vectors(state.tip_velocities),
        hands=quat_multiply(quat, state.hands),
    )
    return other, poses(goals), moved


@pytest.mark.parametrize("yaw", [0.7, -2.0, np.pi])
def test_only_the_place_on_the_table_changes_when_the_world_is_turned(yaw):
    state, goals = draw_state(ROWS), draw_goals(ROWS)
    pushes = draw_pushes(state, goals)
    before, after = view(state, goals, pushes), view(*turned(state, goals, pushes, yaw))
    np.testing.assert_allclose(after.points, before.points, atol=1e-9)
    changes = (after.features - before.features).abs().amax(dim=(0, 1)) > 1e-6
    where = np.flatnonzero(changes)
    assert len(where) == PLACE_FEATURES
    assert where[-1] - where[0] == PLACE_FEATURES - 1


def test_in_a_mirrored_world_every_number_is_the_same_or_its_opposite_and_left_is_right():
    found = draw_transitions(ROWS)
    other = mirrored(found)
    one, two = (view(each.before, each.goals, each.pushes[:, None], side) for each, side in ((found, 1), (other, -1)))
    before, after = one.features.flatten(0, 1), two.features.flatten(0, 1)
    same, opposite = (((after - sign * before).abs() < 1e-9).all(dim=0) for sign in (1, -1))
    left, right = (~(same | opposite)).nonzero().flatten().tolist()
    np.testing.assert_allclose(after[:, [left, right]], -before[:, [right, left]])
    assert opposite.sum() > 10
    np.testing.assert_allclose(two.points, one.points * torch.tensor([1, -1, 1, 1, -1, 1, 1]), atol=1e-9)


@pytest.mark.parametrize("obstacles", [0, 1, 3, 7, 11])
def test_there_are_as_many_features_as_are_counted(obstacles):
    state, goals = draw_state(2, obstacles), draw_goals(2)
    seen = view(state, goals, draw_pushes(state, goals, 2))
    assert seen.features.shape == (2, 4, feature_count(obstacles))
    assert seen.points.shape == (2, 4, SURFACE_POINTS, 7)


def test_the_order_of_obstacles_does_not_matter():
    state, goals = draw_state(ROWS), draw_goals(ROWS)
    pushes = draw_pushes(state, goals)
    shuffled = {name: getattr(state, name) for name in STATE_FIELDS} | {"obstacles": state.obstacles[:, [2, 0, 1]]}
    assert torch.equal(view(PushState(**shuffled), goals, pushes).features, view(state, goals, pushes).features)


def test_a_hand_turned_by_half_a_turn_is_the_same_hand():
    state, goals = draw_state(ROWS), draw_goals(ROWS)
    pushes = draw_pushes(state, goals)
    half = pushes.copy()
    half[..., columns.HAND] = quat_multiply(pushes[..., columns.HAND], np.array([0.0, 0.0, 0.0, 1.0]))
    np.testing.assert_allclose(view(state, goals, half).features, view(state, goals, pushes).features, atol=1e-9)


def test_axes_are_a_turn_about_the_vertical_that_lays_x_along_the_push():
    axes = push_axes(torch.from_numpy(make_push(1.0)))
    np.testing.assert_allclose(axes @ axes.mT, np.eye(3), atol=1e-12)
    assert torch.linalg.det(axes) == pytest.approx(1.0)
    np.testing.assert_allclose(axes @ torch.tensor([0.0, -1.0, 0.0], dtype=torch.float64), [1, 0, 0], atol=1e-12)


def test_points_are_told_from_the_contact_with_their_way_to_the_goal():
    """Of a box that stands upright, pushed along -y, whose goal is 10 cm further on."""
    state, push = draw_state(1), make_push(1.0)
    upright = np.array([[0.1, 0.2, 0.07, 1.0, 0, 0, 0]])
    standing = {name: getattr(state, name) for name in STATE_FIELDS} | {"poses": upright}
    goals = upright + [0, -0.1, 0, 0, 0, 0, 0]
    seen = view(PushState(**standing), goals, push[None, None]).points[0, 0].numpy()
    points = surface(1)[0].astype(np.float64)
    offset = points - push[columns.CONTACT]
    ahead, left = -offset[:, 1], offset[:, 0]
    np.testing.assert_allclose(seen[:, :3], 10 * np.stack([ahead, left, offset[:, 2]], axis=1), atol=1e-9)
    np.testing.assert_allclose(seen[:, 3:6], np.tile([0.5, 0, 0], (SURFACE_POINTS, 1)), atol=1e-9)
    heights = transform_points(upright, points[None])[0, :, 2]
    np.testing.assert_allclose(seen[:, 6], 10 * heights, atol=1e-9)
    assert np.abs(points).max() <= max(BOX.extents_m) / 2 + 1e-6


DEGENERATE = {
    "the goal is reached": lambda state, goals, pushes: goals.__setitem__(slice(None), state.poses),
    "the push is vertical": lambda state, goals, pushes: pushes.__setitem__((..., slice(3, 9)), [0.0, 0, 1, 0, 0, -1]),
    "the goal is half a turn away": lambda state, goals, pushes: goals.__setitem__(
        (slice(None), slice(3, 7)), quat_multiply(np.array([0.0, 1, 0, 0]), state.poses[:, 3:])
    ),
    "the start is the contact": lambda state, goals, pushes: pushes.__setitem__(
        (..., columns.START), pushes[..., columns.CONTACT]
    ),
    "masses are zero": lambda state, goals, pushes: (state.physics.fill(0), state.obstacles.fill(0)),
    "an obstacle is thrown far away": lambda state, goals, pushes: state.obstacles.fill(1e3),
}


@pytest.mark.parametrize("what", DEGENERATE)
def test_degenerate_input_is_seen_as_finite_numbers(what):
    state, goals = draw_state(3), draw_goals(3)
    pushes = draw_pushes(state, goals)
    DEGENERATE[what](state, goals, pushes)
    tensors = [torch.from_numpy(np.asarray(each, dtype=np.float32)) for each in (goals, surface(3), pushes)]
    seen = view_pushes(state.to_tensors(), *tensors)
    assert torch.isfinite(seen.features).all()
    assert torch.isfinite(seen.points).all()
