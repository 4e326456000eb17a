import numpy as np

from clutter6d.geometry import quat_to_matrix
from clutter6d.seeding import generator
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.push_state import PushState
from dapl_baselines.push_policy.segments import AGAINST_SHARE, LENGTH_M, SPEED_M, TOWARDS_SHARE, draw_segments
from tests.dapl_baselines.push_policy.drawn import SHAPES, draw_state


def draw(state: PushState[np.ndarray], count: int = 200, seed: int = 0) -> np.ndarray:
    rotation = quat_to_matrix(state.poses[:, 3:]).transpose(0, 2, 1)
    points, normals = SHAPES.contacts[[0]] @ rotation, SHAPES.normals[[0]] @ rotation
    tips = state.tips - state.poses[:, :3]
    return draw_segments(points, normals, tips, state.hands, count, generator(seed, "test"))


STATE = draw_state(12)
SEGMENTS = draw(STATE)


def test_segments_begin_where_the_tips_are_with_the_hand_as_it_is():
    tips = STATE.tips - STATE.poses[:, :3]
    assert np.array_equal(SEGMENTS[..., columns.START], np.broadcast_to(tips[:, None], (12, 200, 3)))
    assert np.array_equal(SEGMENTS[..., columns.HAND], np.broadcast_to(STATE.hands[:, None], (12, 200, 4)))
    assert (SEGMENTS[..., columns.IS_SEGMENT] == 1).all()


def test_their_contact_is_the_contact_point_nearest_to_the_tips():
    points = SHAPES.contacts[0] @ quat_to_matrix(STATE.poses[:, 3:]).transpose(0, 2, 1)
    tips = STATE.tips - STATE.poses[:, :3]
    for row in range(12):
        nearest = np.linalg.norm(points[row] - tips[row], axis=1).argmin()
        assert (SEGMENTS[row, :, columns.CONTACT] == points[row, nearest]).all()


def test_directions_are_unit_vectors_and_lengths_and_speeds_in_bounds():
    np.testing.assert_allclose(np.linalg.norm(SEGMENTS[..., columns.DIRECTION], axis=-1), 1.0)
    for column, (least, most) in ((columns.LENGTH, LENGTH_M), (columns.SPEED, SPEED_M)):
        assert ((SEGMENTS[..., column] >= least) & (SEGMENTS[..., column] <= most)).all()


def test_most_of_them_go_against_the_surface():
    against = -(SEGMENTS[..., columns.DIRECTION] * SEGMENTS[..., columns.NORMAL]).sum(axis=-1)
    share = TOWARDS_SHARE + AGAINST_SHARE
    assert (against > 0).mean() > 0.5 + 0.5 * (share - 0.3)
    assert (against < 0).mean() > 0.05


def test_segments_depend_on_the_random_numbers_alone():
    assert np.array_equal(draw(STATE), SEGMENTS)
    assert not np.array_equal(draw(STATE, seed=1), SEGMENTS)


def test_tips_that_touch_get_finite_segments():
    rotated = SHAPES.contacts[0, 0] @ quat_to_matrix(STATE.poses[0, 3:]).T
    tips = STATE.tips.copy()
    tips[0] = STATE.poses[0, :3] + rotated
    at_contact = PushState(**{name: getattr(STATE, name) for name in STATE.__slots__ if name != "tips"}, tips=tips)
    assert np.isfinite(draw(at_contact)).all()
