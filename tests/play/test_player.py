"""Keys and buttons in, pictures and words out."""

import numpy as np
import pytest

from clutter6d.errors import InvalidValueError
from clutter6d.play.player import ACTIONS, Player
from clutter6d.play.session import PlaySession
from tests.bad_inputs.policies import fails_to_act
from tests.play.played import PaperView, make_playlist


@pytest.fixture
def view() -> PaperView:
    return PaperView()


@pytest.fixture
def player(view: PaperView) -> Player:
    return Player(PlaySession(make_playlist(), ("boxes-0", 1)), view, is_paused=True)


def ask(player: Player, view: PaperView, *names: str) -> None:
    view.asked = list(names)
    player.tick()


def test_every_action_has_a_key_of_its_own(view: PaperView, player: Player) -> None:
    assert view.offered == ACTIONS
    assert len({action.key for action in ACTIONS}) == len(ACTIONS)
    ask(player, view, *[action.name for action in ACTIONS])


def test_the_start_is_shown_once_and_nothing_more_while_nothing_happens(view: PaperView, player: Player) -> None:
    assert player.tick()
    assert not player.tick()
    assert view.shown == [("boxes-0", 1)]
    assert len(view.qpos) == 1
    assert "step\t0 of 12" in view.text
    assert view.text.endswith("outcome\tpaused")


def test_a_step_moves_everything_once(view: PaperView, player: Player) -> None:
    player.tick()
    ask(player, view, "step")
    assert len(view.qpos) == 2
    assert not np.array_equal(view.qpos[0], view.qpos[1])
    assert "step\t1 of 12" in view.text
    ask(player, view, "back")
    assert np.array_equal(view.qpos[2], view.qpos[0])


def test_time_runs_once_someone_looks(view: PaperView) -> None:
    player = Player(PlaySession(make_playlist(), ("boxes-0", 1)), view)
    player.tick()
    assert "step\t0" in view.text
    view.is_watched = True
    player.tick()
    assert "step\t1" in view.text
    assert "playing" in view.text


def test_an_episode_is_played_to_its_end(view: PaperView, player: Player) -> None:
    player._session.speed = 1e6
    ask(player, view, "toggle")
    for _ in range(20):
        player.tick()
    assert view.text.endswith("outcome\tdrop")


def test_another_pair_is_shown_and_a_restart_shows_nothing_new(view: PaperView, player: Player) -> None:
    player.tick()
    ask(player, view, "next")
    ask(player, view, "restart")
    ask(player, view, "previous")
    assert view.shown == [("boxes-0", 1), ("boxes-1", 0), ("boxes-0", 1)]


def test_the_points_that_the_policy_sees_come_and_go(view: PaperView, player: Player) -> None:
    ask(player, view, "points")
    assert view.points == 512 + 512 + 256
    ask(player, view, "contacts")
    assert view.points > 512 + 512 + 256
    ask(player, view, "points", "contacts")
    assert view.points == 0


def test_it_ends_when_the_window_is_closed(view: PaperView, player: Player) -> None:
    view.close()
    player.run()
    assert view.shown == []


def test_a_policy_that_fails_is_blamed(view: PaperView) -> None:
    player = Player(PlaySession(make_playlist(fails_to_act(None)), ("boxes-0", 1)), view, is_paused=True)
    ask(player, view, "step")
    with pytest.raises(InvalidValueError, match="policy 'wrong' failed"):
        ask(player, view, "step")
