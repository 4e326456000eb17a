import json
import shutil
from pathlib import Path

import pandas as pd
import pytest

from clutter6d.errors import InvalidFileError, InvalidValueError, MissingFileError
from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.eval.replay import Replay
from tests.eval.scripted import ScriptedPolicy, scenes_with_known_outcomes
from tests.scene_fixtures import make_box_scene_set


@pytest.fixture(scope="module")
def evaluated(tmp_path_factory):
    out = tmp_path_factory.mktemp("evaluation")
    evaluation = Evaluation(make_box_scene_set(2), ScriptedPolicy(), out, EvaluationConfig(max_steps=12))
    for part in ("journal", "floor"):
        list(evaluation.run(part, num_envs=3, threads=1))
    evaluation.finish()
    return out


@pytest.fixture
def folder(tmp_path, evaluated):
    return Path(shutil.copytree(evaluated, tmp_path / "out"))


def verdicts(folder, scenes=None):
    check = Replay(folder, scenes or make_box_scene_set(2))
    found = {(verdict.scene_id, verdict.pair): verdict.differing for verdict in check.run(num_envs=2, threads=1)}
    return found, check.check_report(num_envs=2, threads=1)


def tamper(path, change):
    frame = pd.read_parquet(path)
    changed = change(frame)
    (frame if changed is None else changed).to_parquet(path, index=False)


def test_an_honest_evaluation_replays_to_the_bit(folder):
    found, wrong = verdicts(folder)
    assert found == dict.fromkeys([("boxes-0", 0), ("boxes-0", 1), ("boxes-1", 0), ("boxes-1", 1)], ())
    assert wrong == ()


def test_successes_and_drops_replay_to_the_bit(tmp_path):
    scenes = scenes_with_known_outcomes()
    evaluation = Evaluation(scenes, ScriptedPolicy(), tmp_path / "out", EvaluationConfig(max_steps=20))
    for part in ("journal", "floor"):
        list(evaluation.run(part, num_envs=5, threads=2))
    assert evaluation.finish().success_rate == 0.5
    found, wrong = verdicts(tmp_path / "out", scenes)
    assert not any(found.values())
    assert wrong == ()


def test_one_changed_bit_of_an_action_is_seen(folder):
    def change(frame):
        frame.loc[30, "action_3"] += frame["action_3"].dtype.type(1e-8)

    tamper(folder / "actions.parquet", change)
    found, _ = verdicts(folder)
    assert [key for key, differing in found.items() if differing] == [("boxes-1", 0)]
    assert "final_state_sha256" in found["boxes-1", 0]


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("is_success", True),
        ("outcome", "success"),
        ("steps", 11),
        ("mean_offset_cm", 0.0),
        ("position_error_m", 0.01),
        ("holds", True),
        ("is_planar_success", True),
    ],
)
def test_a_changed_outcome_or_metric_is_seen(folder, column, value):
    def change(frame):
        frame.loc[1, column] = value

    tamper(folder / "episodes.parquet", change)
    found, wrong = verdicts(folder)
    assert found["boxes-0", 1] == (column,)
    assert wrong or column in ("position_error_m",)


@pytest.mark.parametrize(
    ("field", "value"),
    [("success_rate", 0.9), ("mean_offset_cm", 0.0), ("zero_action_mean_offset_cm", 9.0), ("label", "official")],
)
def test_a_changed_report_is_seen(folder, field, value):
    path = folder / "report.json"
    report = json.loads(path.read_text())
    report[field] = value
    path.write_text(json.dumps(report))
    found, wrong = verdicts(folder)
    assert not any(found.values())
    assert wrong == (field,)


@pytest.mark.parametrize("file", ["episodes.parquet", "actions.parquet"])
def test_missing_episodes_are_refused(folder, file):
    tamper(folder / file, lambda frame: frame[frame["scene_id"] != "boxes-1"])
    with pytest.raises(InvalidFileError, match="boxes-1 pair 0"):
        Replay(folder, make_box_scene_set(2))


@pytest.mark.parametrize(
    "change",
    [
        lambda frame: frame.drop(columns="action_1"),
        lambda frame: frame.assign(extra=1),
        lambda frame: frame.assign(action_1=frame["action_1"].astype("float64")),
        lambda frame: frame.assign(action_1=frame["action_1"] * float("nan")),
        lambda frame: frame.drop(index=3),
    ],
)
def test_a_table_of_actions_of_another_form_is_refused(folder, change):
    tamper(folder / "actions.parquet", change)
    with pytest.raises(InvalidFileError, match="actions.parquet"):
        Replay(folder, make_box_scene_set(2))


@pytest.mark.parametrize("file", ["episodes.parquet", "actions.parquet", "report.json"])
def test_a_truncated_file_is_refused(folder, file):
    path = folder / file
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(InvalidFileError, match=file):
        Replay(folder, make_box_scene_set(2))
    path.unlink()
    with pytest.raises(MissingFileError, match=file):
        Replay(folder, make_box_scene_set(2))


def test_other_scenes_are_refused(folder):
    scenes = make_box_scene_set(2)
    object.__setattr__(scenes, "sha256", "c" * 64)
    with pytest.raises(InvalidValueError, match="not the scenes of the evaluation"):
        Replay(folder, scenes)


def test_another_engine_is_refused(folder):
    path = folder / "report.json"
    path.write_text(path.read_text().replace("mujoco 4", "mujoco 3"))
    with pytest.raises(InvalidValueError, match="install that version"):
        Replay(folder, make_box_scene_set(2))
