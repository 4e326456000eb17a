import numpy as np

from clutter6d.seeding import generator
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.candidates import Counts, draw_candidates
from dapl_baselines.push_policy.target_shapes import TargetShapes
from tests.dapl_baselines.push_policy.drawn import BOX, draw_goals, draw_state
from tests.scene_fixtures import make_box_asset

SHAPES = TargetShapes.of([BOX, make_box_asset("flat", (0.2, 0.2, 0.02))])
STATE, GOALS = draw_state(4), draw_goals(4)


def draw(segments: int, whole: int, targets: tuple[int, ...] = (0, 1, 0, 1)) -> np.ndarray:
    counts = Counts(segments=segments, whole=whole)
    return draw_candidates(STATE, GOALS, SHAPES, np.array(targets), counts, generator(0, "test"))


def test_segments_come_first_then_whole_pushes():
    drawn = draw(5, 3)
    assert drawn.shape == (4, 8, columns.SIZE)
    assert (drawn[..., columns.IS_SEGMENT] == ([1] * 5 + [0] * 3)).all()


def test_each_row_is_pushed_by_its_own_targets_shape():
    one, other = draw(4, 4, (0, 0, 0, 0)), draw(4, 4)
    assert np.array_equal(one[[0, 2]], other[[0, 2]])
    assert not np.array_equal(one[[1, 3]], other[[1, 3]])


def test_starts_of_segments_are_where_the_tips_are_whatever_frame_they_are_told_in():
    starts = STATE.poses[:, None, :3] + draw(2, 1)[:, :2, columns.START]
    np.testing.assert_allclose(starts, np.broadcast_to(STATE.tips[:, None], starts.shape))
