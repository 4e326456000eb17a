"""What is played: a policy on scenes, or a recorded evaluation."""

from dataclasses import replace
from pathlib import Path

import pytest

from clutter6d.errors import InvalidValueError
from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.eval.runner import HOLD_STEPS
from clutter6d.play.playlist import Playlist, live_playlist, recorded_playlist
from clutter6d.play.session import PlaySession
from tests.eval.scripted import ScriptedPolicy, scenes_with_known_outcomes
from tests.scene_fixtures import make_box_scene_set


@pytest.fixture(scope="module")
def evaluation(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished evaluation."""
    out = tmp_path_factory.mktemp("evaluation") / "out"
    made = Evaluation(scenes_with_known_outcomes(), ScriptedPolicy(), out, EvaluationConfig(max_steps=8))
    for part in ("journal", "floor"):
        list(made.run(part, threads=1))
    made.finish()
    return out


def test_every_pair_of_every_scene_is_played() -> None:
    scenes = make_box_scene_set(2)
    assert live_playlist(scenes, ScriptedPolicy()).keys == (
        ("boxes-0", 0), ("boxes-0", 1), ("boxes-1", 0), ("boxes-1", 1)
    )  # fmt: skip
    assert live_playlist(scenes, ScriptedPolicy(), only=["boxes-1"]).scene_ids == ("boxes-1",)


def test_a_recorded_evaluation_can_be_sought_at_once_and_ends_as_recorded(evaluation: Path) -> None:
    session = PlaySession(recorded_playlist(evaluation, scenes_with_known_outcomes()))
    for _ in session.playlist.keys:
        row = session.recorded_row
        assert row is not None
        assert session.last_step == row.steps + HOLD_STEPS * row.is_success
        session.seek(session.last_step)
        assert session.is_over
        assert session.frame.outcome == row.outcome
        assert session._episode.record is not None
        assert session._episode.record.row.differences(row) == ()
        session.go(1)


def test_an_evaluation_is_played_on_its_own_scenes_only(evaluation: Path) -> None:
    others = replace(scenes_with_known_outcomes(), sha256="c" * 64)
    with pytest.raises(InvalidValueError, match="not the scenes of the evaluation"):
        recorded_playlist(evaluation, others)


def test_nothing_cannot_be_played() -> None:
    with pytest.raises(InvalidValueError, match="no episode to play"):
        Playlist(scenes=make_box_scene_set(1), keys=(), policy=ScriptedPolicy(), title="")
