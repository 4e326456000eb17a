import json

import numpy as np
import pandas as pd
import pytest

from clutter6d.errors import InvalidFileError, InvalidValueError
from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.eval.policy_loading import load_policy
from clutter6d.eval.report import Report
from clutter6d.eval.tables import read_actions, read_rows
from clutter6d.schema import read_model
from tests.eval.scripted import ScriptedPolicy, scenes_with_known_outcomes
from tests.scene_fixtures import make_box_scene_set

SHORT = EvaluationConfig(max_steps=12)


def evaluate(scenes, policy, out, config=SHORT, *, num_envs=4, threads=1) -> Report:
    evaluation = Evaluation(scenes, policy, out, config)
    for part in ("journal", "floor"):
        list(evaluation.run(part, num_envs=num_envs, threads=threads))
    return evaluation.finish()


def table(folder) -> pd.DataFrame:
    frame = pd.read_parquet(folder / "episodes.parquet")
    return frame.drop(columns=[name for name in frame if name.startswith("timing_")])


@pytest.mark.parametrize("make_policy", [ScriptedPolicy, lambda: load_policy("random")])
def test_the_result_does_not_depend_on_environments_or_threads(tmp_path, make_policy):
    scenes = make_box_scene_set(3)
    evaluate(scenes, make_policy(), tmp_path / "a", num_envs=4, threads=1)
    for name, num_envs, threads in (("b", 16, 2), ("c", 1, 2), ("d", 3, 1)):
        evaluate(scenes, make_policy(), tmp_path / name, num_envs=num_envs, threads=threads)
        pd.testing.assert_frame_equal(table(tmp_path / name), table(tmp_path / "a"), check_exact=True)
        for file in ("actions.parquet", "report.json", "report.md", "run.json"):
            assert (tmp_path / name / file).read_bytes() == (tmp_path / "a" / file).read_bytes(), file


def test_outcomes_are_those_of_the_scenes(tmp_path):
    scenes = scenes_with_known_outcomes()
    report = evaluate(scenes, load_policy("zero"), tmp_path / "out", EvaluationConfig(max_steps=20), num_envs=2)
    rows = {row.key: row for row in read_rows(tmp_path / "out")}
    for index in range(3):
        at_goal, falling = rows[f"boxes-{index}", 0], rows[f"boxes-{index}", 1]
        assert (at_goal.outcome, at_goal.steps, at_goal.holds) == ("success", 1, True)
        assert at_goal.is_planar_success
        assert at_goal.is_symmetric_success
        assert falling.outcome == "drop"
        assert 1 < falling.steps < 20
    assert report.success_rate == 0.5
    assert report.hold_rate == 0.5
    assert report.outcomes == {"drop": 3, "success": 3}
    assert report.mean_offset_cm == report.zero_action_mean_offset_cm


def test_episodes_end_at_the_last_step_at_the_latest(tmp_path):
    report = evaluate(make_box_scene_set(1), load_policy("zero"), tmp_path / "out")
    assert report.outcomes == {"timeout": 2}
    assert report.mean_steps == 12
    assert report.label == "not official"


def test_a_killed_evaluation_continues_and_ends_as_if_it_had_not_been_killed(tmp_path):
    scenes = make_box_scene_set(3)
    evaluate(scenes, ScriptedPolicy(), tmp_path / "whole")
    broken = Evaluation(scenes, ScriptedPolicy(), tmp_path / "broken", SHORT).run(num_envs=2, threads=1)
    for _ in range(3):
        next(broken)
    broken.close()
    assert len(Evaluation(scenes, ScriptedPolicy(), tmp_path / "broken", SHORT).finished()) == 3
    evaluate(scenes, ScriptedPolicy(), tmp_path / "broken", num_envs=3)
    pd.testing.assert_frame_equal(table(tmp_path / "broken"), table(tmp_path / "whole"), check_exact=True)


def test_nothing_is_run_twice(tmp_path):
    scenes = make_box_scene_set(1)
    evaluate(scenes, load_policy("zero"), tmp_path / "out")
    assert list(Evaluation(scenes, load_policy("zero"), tmp_path / "out", SHORT).run()) == []


@pytest.mark.parametrize(
    ("policy", "config", "named"),
    [
        ("random", SHORT, "policy was zero, is random"),
        ("zero", EvaluationConfig(max_steps=12, seed=1), "seed was 0, is 1"),
        ("zero", EvaluationConfig(max_steps=13), "max_steps was 12, is 13"),
        ("zero", EvaluationConfig(max_steps=12, pairs=1), "pairs was 2, is 1"),
    ],
)
def test_a_folder_of_an_evaluation_with_other_settings_is_refused(tmp_path, policy, config, named):
    scenes = make_box_scene_set(1)
    Evaluation(scenes, load_policy("zero"), tmp_path / "out", SHORT)
    with pytest.raises(InvalidValueError, match=named):
        Evaluation(scenes, load_policy(policy), tmp_path / "out", config)


def test_a_folder_with_something_else_in_it_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(InvalidValueError, match="choose another --out"):
        Evaluation(make_box_scene_set(1), load_policy("zero"), tmp_path, SHORT)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_pairs_limits_the_goal_pairs_of_each_scene(tmp_path):
    report = evaluate(
        make_box_scene_set(3), load_policy("zero"), tmp_path / "out", EvaluationConfig(max_steps=2, pairs=1)
    )
    assert report.episodes == 3
    assert set(read_actions(tmp_path / "out")) == {(f"boxes-{index}", 0) for index in range(3)}


def test_the_report_carries_everything_a_number_needs(tmp_path):
    report = evaluate(make_box_scene_set(2), load_policy("random"), tmp_path / "out")
    assert read_model(tmp_path / "out" / "report.json", Report, what="report") == report
    stored = json.loads((tmp_path / "out" / "report.json").read_text())
    assert stored["split_sha256"] == "b" * 64
    assert stored["engine"].startswith("mujoco 4")
    assert (stored["episodes"], stored["seed"], stored["policy"]) == (4, 0, "random")
    page = (tmp_path / "out" / "report.md").read_text()
    for needed in ("n = 4", "Wilson", "bootstrap", "floor", "b" * 64, report.policy_hash, "not official"):
        assert needed in page


def test_recorded_actions_are_float32_one_row_a_step(tmp_path):
    evaluate(make_box_scene_set(1), load_policy("random"), tmp_path / "out")
    actions = read_actions(tmp_path / "out")["boxes-0", 0]
    assert actions.dtype == np.float32
    assert actions.shape == (12, 7)
    assert np.abs(actions).max() <= np.float32(0.1)


def test_a_damaged_episode_file_is_named(tmp_path):
    scenes = make_box_scene_set(1)
    evaluate(scenes, load_policy("zero"), tmp_path / "out")
    path = tmp_path / "out" / "journal" / "boxes-0@0001.json"
    path.write_text(path.read_text().replace('"steps": 12', '"steps": 11'))
    with pytest.raises(InvalidFileError, match="boxes-0@0001.json"):
        Evaluation(scenes, load_policy("zero"), tmp_path / "out", SHORT).finished()


class _Faulty(ScriptedPolicy):
    def __init__(self, actions) -> None:
        self.actions = actions

    def begin(self, slots, episodes) -> None:
        pass

    def act(self, inputs):
        if isinstance(self.actions, Exception):
            raise self.actions
        return self.actions


@pytest.mark.parametrize(
    ("actions", "said"),
    [
        (np.full((2, 7), np.nan, np.float32), "not finite at scene boxes-0, pair 0, step 0"),
        (np.zeros((2, 7)), "float64"),
        (np.zeros((3, 7), np.float32), r"float32\(3, 7\)"),
        (None, "NoneType"),
        (ZeroDivisionError("oh"), "failed: ZeroDivisionError: oh"),
    ],
)
def test_a_policy_that_misbehaves_is_blamed_in_one_line(tmp_path, actions, said):
    evaluation = Evaluation(make_box_scene_set(1), _Faulty(actions), tmp_path / "out", SHORT)
    with pytest.raises(InvalidValueError, match=said) as caught:
        list(evaluation.run(num_envs=2, threads=1))
    assert "\n" not in str(caught.value)
