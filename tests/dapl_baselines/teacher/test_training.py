from pathlib import Path

import numpy as np
import pytest
import torch
from pydantic import ValidationError

from clutter6d.cli import run
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import TerminationConfig
from clutter6d.errors import InvalidFileError, InvalidValueError
from clutter6d.eval.policy import PolicyOptions
from clutter6d.eval.runner import EpisodeRunner
from dapl_baselines.checkpoint import load_checkpoint_policy, read_checkpoint
from dapl_baselines.push_policy.outcomes import Prices
from dapl_baselines.teacher.settings import PRESETS, TeacherSettings
from dapl_baselines.teacher.training import TeacherTraining
from dapl_baselines.validation import part_scenes
from tests.dapl_baselines.interrupted import curve, kill_after, outcome
from tests.dapl_baselines.teacher.small_teacher import SETTINGS, make_training
from tests.scene_fixtures import make_box_scene_set, write_box_scene_set


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("unbroken") / "run"
    assert [report.iteration for report in make_training(folder).run()] == list(range(1, 9))
    return folder


def test_it_leaves_curves_and_a_checkpoint_that_says_where_it_is_from(unbroken):
    training = curve(unbroken / "training.csv")
    pushes, updates = ([int(row[name]) for row in training] for name in ("pushes", "updates"))
    assert (np.diff(pushes) >= 0).all()
    learned = [before >= SETTINGS.warm_up for before in (0, *pushes[:-1])]
    assert updates == (np.cumsum(learned) * SETTINGS.updates).tolist()
    assert [row["gain"] != "nan" for row in training] == learned
    assert [int(row["iteration"]) for row in curve(unbroken / "validation.csv")] == [4, 8]
    record = read_checkpoint(unbroken / "policy.pt").header.history[-1]
    assert (record.method, record.steps) == ("push-critic", 8 * SETTINGS.steps * SETTINGS.slots)


def test_killed_and_continued_it_is_the_unbroken_run_to_the_bit(unbroken, tmp_path):
    kill_after(5, "tests.dapl_baselines.teacher.small_teacher", tmp_path / "run")
    again = make_training(tmp_path / "run")
    assert again.standing.iteration == 4
    list(again.run())
    assert outcome(tmp_path / "run") == outcome(unbroken)


@pytest.mark.slow
def test_killed_where_the_newest_transitions_take_the_place_of_the_oldest_it_is_the_unbroken_run(tmp_path):
    """Episodes of one step fill the replay in eight iterations."""
    changes = {"slots": 16, "steps": 8, "max_steps": 1, "iterations": 12, "evaluate_every": 100, "save_every": 3}
    settings = SETTINGS.model_copy(update=changes)
    list(make_training(tmp_path / "unbroken", settings).run())
    broken = tmp_path / "broken"
    for stop in (8, 11):  # two iterations after a state was written
        reports = make_training(broken, settings).run()
        while next(reports).iteration < stop:
            pass
        reports.close()
    list(make_training(broken, settings).run())
    assert int(curve(broken / "training.csv")[-1]["pushes"]) > SETTINGS.kept
    assert outcome(broken) == outcome(tmp_path / "unbroken")


def test_threads_do_not_change_it(unbroken, tmp_path):
    scenes = part_scenes(make_box_scene_set(3))
    reports = TeacherTraining(scenes, SETTINGS, tmp_path / "run", threads=2).run()
    for _ in range(3):
        next(reports)
    reports.close()
    assert curve(tmp_path / "run" / "training.csv") == curve(unbroken / "training.csv")[:3]


@pytest.mark.parametrize(
    ("change", "said"),
    [({"huber": 0.5}, r"with other settings \(settings.huber was 0.3"), ({"seed": 1}, r"settings.seed was 0, is 1")],
)
def test_a_folder_with_other_settings_is_refused(unbroken, change, said):
    with pytest.raises(InvalidValueError, match=said) as caught:
        make_training(unbroken, SETTINGS.model_copy(update=change))
    assert "\n" not in str(caught.value)


def test_a_finished_training_may_be_given_more_iterations(unbroken):
    assert list(make_training(unbroken).run()) == []
    assert make_training(unbroken, SETTINGS.model_copy(update={"iterations": 9})).standing.iteration == 8
    make_training(unbroken)


def test_it_may_begin_with_a_trained_teacher_and_says_so(unbroken, tmp_path):
    start = read_checkpoint(unbroken / "policy.pt")
    training = make_training(tmp_path / "run", SETTINGS.model_copy(update={"learning_rate": 1e-9}), start=start)
    assert len(list(training.run())) == 8
    made, before = read_checkpoint(tmp_path / "run" / "policy.pt"), start.module.state_dict()
    for name, weights in made.module.state_dict().items():
        torch.testing.assert_close(weights, before[name], atol=1e-2, rtol=1e-2)
    assert made.header.history[:-1] == start.header.history
    with pytest.raises(InvalidValueError, match="start_sha256"):
        make_training(tmp_path / "run", SETTINGS.model_copy(update={"learning_rate": 1e-9}))


def test_a_teacher_of_another_size_or_other_prices_is_no_start(unbroken, tmp_path):
    start = read_checkpoint(unbroken / "policy.pt")
    for change, said in (({"hidden_size": 8}, "hidden_size is 8, and 16"), ({"prices": Prices(step=0.5)}, "prices is")):
        critic = SETTINGS.critic.model_copy(update=change)
        with pytest.raises(InvalidValueError, match=said):
            make_training(tmp_path / "run", SETTINGS.model_copy(update={"critic": critic}), start=start)
    assert not (tmp_path / "run").exists()


def actions(policy, slots: int) -> dict[tuple[str, int], np.ndarray]:
    scenes = make_box_scene_set(2)
    keys = [(scene.scene_id, pair) for scene in scenes.scenes for pair in range(2)]
    config = EnvConfig(termination=TerminationConfig(max_steps=15))
    runner = EpisodeRunner(scenes, policy, config=config, num_envs=slots, threads=1)
    return {(record.row.scene_id, record.row.pair): record.actions for record in runner.run(keys)}


def test_its_checkpoint_acts_the_same_in_one_slot_and_in_three(unbroken):
    policy = load_checkpoint_policy(unbroken / "policy.pt", PolicyOptions())
    alone, beside = actions(policy, 1), actions(policy, 3)
    assert all(np.array_equal(alone[key], beside[key]) for key in alone)


def test_it_is_evaluated_and_replayed_as_any_policy(unbroken, tmp_path):
    write_box_scene_set(tmp_path / "scenes", 1)
    where = ["--scenes", str(tmp_path / "scenes"), "--out", str(tmp_path / "out"), "--max-steps", "2"]
    assert run(["evaluate", "--policy", str(unbroken / "policy.pt"), *where, "--threads", "1"]) == 0
    assert run(["replay", str(tmp_path / "out"), "--threads", "1"]) == 0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda state: state.update(format="another"), "not the state of this training"),
        (lambda state: state.pop("slots"), "KeyError"),
        (lambda state: state["critic"].popitem(), "RuntimeError"),
    ],
)
def test_a_damaged_state_is_refused_in_one_line(unbroken, tmp_path, change, said):
    state = torch.load(unbroken / "state.pt", weights_only=True)
    change(state)
    (tmp_path / "run.json").write_text((unbroken / "run.json").read_text())
    torch.save(state, tmp_path / "state.pt")
    with pytest.raises(InvalidFileError, match=said) as caught:
        make_training(tmp_path)
    assert "\n" not in str(caught.value)


def test_what_is_kept_must_outlast_what_is_added_between_two_states():
    with pytest.raises(ValidationError, match="kept: 1000 is less than twice slots"):
        TeacherSettings(slots=64, steps=20, save_every=1, kept=1000)
    assert all(settings.kept >= 2 * settings.rows_at_risk for settings in PRESETS.values())
