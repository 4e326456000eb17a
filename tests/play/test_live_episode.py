"""What is seen is what is scored."""

import numpy as np
import pytest

from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.eval.runner import HOLD_STEPS, EpisodeRunner
from clutter6d.play.live_episode import LiveEpisode
from tests.eval.scripted import ScriptedPolicy
from tests.play.played import make_playlist

KEYS = [("boxes-0", 0), ("boxes-0", 1), ("boxes-2", 0)]


def make_runner(**options) -> EpisodeRunner:
    playlist = make_playlist()
    return EpisodeRunner(playlist.scenes, ScriptedPolicy(), config=playlist.config, **options)


def play_to_the_end(episode: LiveEpisode) -> list[str | None]:
    outcomes = [episode.frame.outcome]
    while episode.record is None:
        outcomes.append(episode.advance().outcome)
    return outcomes


@pytest.mark.parametrize("key", KEYS, ids=lambda key: f"{key[0]}-{key[1]}")
def test_a_watched_episode_ends_as_the_evaluated_one_to_the_bit(key) -> None:
    evaluated = {record.row.key: record for record in make_runner(num_envs=3, threads=1).run(KEYS)}[key]
    watched = LiveEpisode(make_runner(num_envs=1, threads=1), key)
    play_to_the_end(watched)
    assert watched.record is not None
    assert watched.record.row.differences(evaluated.row) == ()
    assert np.array_equal(watched.record.actions, evaluated.actions)


def test_a_success_is_held_for_a_second_before_the_episode_is_over() -> None:
    episode = LiveEpisode(make_runner(num_envs=1, threads=1), ("boxes-0", 0))
    assert play_to_the_end(episode) == [None] + ["success"] * (1 + HOLD_STEPS)
    assert episode.frame.step == 1 + HOLD_STEPS
    assert episode.frame.holds is True


def test_a_frame_holds_what_the_policy_sees() -> None:
    episode = LiveEpisode(make_runner(num_envs=1, threads=1), ("boxes-0", 0))
    frame = episode.frame
    assert np.abs(frame.target_points.mean(axis=0) - frame.qpos[7:10]).max() < 0.02
    assert frame.position_m == 0
    assert frame.reward["total"] == pytest.approx(sum(frame.reward[name] for name in frame.reward if name != "total"))
    assert frame.hand_points[:, 2].min() > 0


def test_an_episode_that_is_not_there_is_named() -> None:
    with pytest.raises(UnknownNameError, match="boxes-9"):
        LiveEpisode(make_runner(num_envs=1), ("boxes-9", 0))
    with pytest.raises(InvalidValueError, match="goal pairs 0 to 1, not 2"):
        LiveEpisode(make_runner(num_envs=1), ("boxes-0", 2))
