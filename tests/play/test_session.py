"""Playing, stepping, going back, choosing."""

import numpy as np
import pytest

from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.eval.runner import HOLD_STEPS
from clutter6d.play.session import PlaySession
from tests.play.played import make_playlist


@pytest.fixture
def session() -> PlaySession:
    """Begins with an episode in which something is about to fall."""
    return PlaySession(make_playlist(), ("boxes-0", 1))


def test_it_begins_paused_at_the_start(session: PlaySession) -> None:
    assert (session.frame.step, session.is_playing, session.is_over, session.last_step) == (0, False, False, 0)
    assert session.frame.qpos[7:].reshape(-1, 7) == pytest.approx(session.scene.goal_pairs[1].object_poses)


def test_going_back_and_forth_simulates_nothing_twice(session: PlaySession) -> None:
    session.step()
    session.step()
    first = session.frame
    session.step_back()
    session.step_back()
    session.step_back()
    assert session.frame.step == 0
    session.seek(2)
    assert session.frame is first


def test_a_live_episode_can_be_sought_as_far_as_it_was_simulated(session: PlaySession) -> None:
    session.step(2)
    session.seek(100)
    assert session.frame.step == 2
    session.seek(-5)
    assert session.frame.step == 0


def test_time_stops_at_the_end_and_the_end_can_be_played_again(session: PlaySession) -> None:
    session.toggle()
    session.step(100)
    assert session.is_over
    assert not session.is_playing
    assert session.frame.outcome == "drop"
    last = session.frame.step
    session.step()
    assert session.frame.step == last
    session.toggle()
    assert (session.frame.step, session.is_playing) == (0, True)


def test_a_restarted_episode_runs_as_before(session: PlaySession) -> None:
    session.step(3)
    before = session.frame.qpos
    session.restart()
    assert session.last_step == 0
    session.step(3)
    assert np.array_equal(session.frame.qpos, before)


def test_the_list_is_gone_through_in_its_order_and_round(session: PlaySession) -> None:
    seen = []
    for _ in range(6):
        session.go(1)
        seen.append((session.selection.scene_id, session.selection.pair))
    assert seen == [("boxes-1", 0), ("boxes-1", 1), ("boxes-2", 0), ("boxes-2", 1), ("boxes-0", 0), ("boxes-0", 1)]
    session.go(-1)
    assert (session.selection.scene_id, session.selection.pair, session.selection.number) == ("boxes-0", 0, 0)


def test_a_scene_is_chosen_by_its_id(session: PlaySession) -> None:
    session.select("boxes-2")
    assert (session.selection.scene_id, session.selection.pair) == ("boxes-2", 0)
    session.select("boxes-2", 1)
    assert session.frame.qpos[7:].reshape(-1, 7) == pytest.approx(session.scene.goal_pairs[1].object_poses)
    assert session.pairs() == (0, 1)


def test_what_is_not_in_the_list_is_refused_and_nothing_changes(session: PlaySession) -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'boxes-2'"):
        session.select("boxes-22")
    with pytest.raises(InvalidValueError, match="goal pairs 0 to 1, not 7"):
        session.select("boxes-1", 7)
    assert (session.selection.scene_id, session.selection.pair) == ("boxes-0", 1)


def test_a_held_success_is_part_of_the_episode() -> None:
    session = PlaySession(make_playlist(), ("boxes-1", 0))
    session.step(100)
    assert (session.frame.outcome, session.frame.holds) == ("success", True)
    assert session.last_step == 1 + HOLD_STEPS
