"""Which episodes are recorded."""

import pytest

from clutter6d.errors import InvalidValueError, MissingFileError
from clutter6d.recording.source import read_evaluation, spread_keys
from tests.recording.recorded import evaluate, known_episodes
from tests.scene_fixtures import BoxSceneSet, make_box_scene_set

KEYS = [("a", 0), ("a", 1), ("b", 0), ("b", 1), ("c", 0)]


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    return known_episodes(tmp_path_factory.mktemp("evaluation"))


def test_few_episodes_are_spread_over_many_scenes():
    assert spread_keys(KEYS, 4) == (("a", 0), ("b", 0), ("c", 0), ("a", 1))
    assert len(spread_keys(KEYS, None)) == len(spread_keys(KEYS, 99)) == 5


def test_episodes_are_recorded_in_the_order_of_scenes(known):
    assert known.chosen(count=4).keys == (("boxes-0", 0), ("boxes-0", 1), ("boxes-1", 0), ("boxes-2", 0))


def test_only_successes_are_those_among_the_first(known):
    chosen = known.chosen(count=4, only_successes=True)
    assert chosen.keys == (("boxes-0", 0), ("boxes-1", 0), ("boxes-2", 0))
    assert all(record.row.is_success for record in chosen.records)


def test_an_unfinished_evaluation_gives_what_has_ended(tmp_path):
    scenes = make_box_scene_set(1)
    unfinished = evaluate(tmp_path / "unfinished", scenes, is_finished=False)
    finished = evaluate(tmp_path / "finished", scenes)
    assert unfinished.keys == finished.keys
    assert all((a.actions == b.actions).all() for a, b in zip(unfinished.records, finished.records, strict=True))
    (tmp_path / "unfinished" / "journal" / "boxes-0@0001.json").unlink()
    assert read_evaluation(tmp_path / "unfinished", scenes).keys == (("boxes-0", 0),)


def test_what_cannot_be_recorded_is_refused(tmp_path):
    scenes = make_box_scene_set(1)
    with pytest.raises(MissingFileError, match="evaluation not found"):
        read_evaluation(tmp_path, scenes)
    episodes = evaluate(tmp_path / "made", scenes)
    with pytest.raises(InvalidValueError, match="none of 2 episodes is a success"):
        episodes.chosen(only_successes=True)
    other = BoxSceneSet(scenes=scenes.scenes, assets=scenes.assets, sha256="c" * 64)
    with pytest.raises(InvalidValueError, match="other scenes"):
        read_evaluation(tmp_path / "made", other)
