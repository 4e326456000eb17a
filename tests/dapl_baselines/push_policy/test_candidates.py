from dataclasses import replace

import numpy as np

from clutter6d.seeding import generator
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.candidates import Counts, draw_candidates
from dapl_baselines.push_policy.push_state import PushState
from dapl_baselines.push_policy.target_shapes import TargetShapes
from tests.dapl_baselines.push_policy.drawn import BOX, draw_goals, draw_state
from tests.scene_fixtures import make_box_asset

SHAPES = TargetShapes.of([BOX, make_box_asset("flat", (0.2, 0.2, 0.02))])
STATE, GOALS = draw_state(4), draw_goals(4)
TARGETS = np.array([0, 1, 0, 1])
NEAR = replace(STATE, tips=SHAPES.placed_contacts(TARGETS, STATE.poses)[:, 7] + [0, 0, 0.03])
FAR = replace(STATE, tips=STATE.poses[:, :3] + [0, 0, 0.4])


def draw(segments: int, whole: int, state: PushState = NEAR, targets: np.ndarray = TARGETS) -> np.ndarray:
    counts = Counts(segments=segments, whole=whole)
    return draw_candidates(state, GOALS, SHAPES, targets, counts, generator(0, "test"))


def test_near_the_target_segments_come_first_then_whole_pushes():
    drawn = draw(5, 3)
    assert drawn.shape == (4, 8, columns.SIZE)
    assert (drawn[..., columns.IS_SEGMENT] == ([1] * 5 + [0] * 3)).all()


def test_far_from_the_target_there_are_as_many_whole_pushes_instead():
    drawn = draw(5, 3, FAR)
    assert drawn.shape == (4, 8, columns.SIZE)
    assert not drawn[..., columns.IS_SEGMENT].any()
    assert len(np.unique(drawn[0, :, columns.LENGTH])) == 8


def test_each_row_is_pushed_by_its_own_targets_shape():
    one, other = draw(4, 4, FAR, np.zeros(4, dtype=np.int64)), draw(4, 4, FAR)
    assert np.array_equal(one[[0, 2]], other[[0, 2]])
    assert not np.array_equal(one[[1, 3]], other[[1, 3]])


def test_starts_of_segments_are_where_the_tips_are_whatever_frame_they_are_told_in():
    starts = NEAR.poses[:, None, :3] + draw(2, 1)[:, :2, columns.START]
    np.testing.assert_allclose(starts, np.broadcast_to(NEAR.tips[:, None], starts.shape))
