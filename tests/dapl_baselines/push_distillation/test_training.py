from pathlib import Path

import numpy as np
import pytest
import torch

from clutter6d.cli import run
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import TerminationConfig
from clutter6d.errors import InvalidFileError, InvalidValueError
from clutter6d.eval.policy import PolicyOptions
from clutter6d.eval.runner import EpisodeRunner
from dapl_baselines.checkpoint import load_checkpoint_policy, read_checkpoint
from dapl_baselines.cli import PROGRAM
from dapl_baselines.serving.served_policy import open_policy, try_out
from tests.dapl_baselines.distillation.small_distillation import make_encoder
from tests.dapl_baselines.interrupted import curve, kill_after, outcome
from tests.dapl_baselines.push_distillation.small_push_distillation import (
    SETTINGS,
    TEACHER,
    make_distillation,
    make_teacher,
)
from tests.dapl_baselines.push_distillation.test_lessons import make_slots
from tests.scene_fixtures import make_box_scene_set, write_box_scene_set


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("unbroken") / "run"
    assert [report.iteration for report in make_distillation(folder).run()] == list(range(1, 7))
    return folder


def test_it_leaves_curves_and_a_policy_that_is_not_privileged(unbroken):
    assert [int(row["iteration"]) for row in curve(unbroken / "validation.csv")] == [3, 6]
    assert int(curve(unbroken / "training.csv")[-1]["lessons"]) > 5
    checkpoint = read_checkpoint(unbroken / "policy.pt")
    record = checkpoint.header.history[-1]
    assert (record.method, record.steps) == ("push-distillation", 6 * 24)
    policy = load_checkpoint_policy(unbroken / "policy.pt", PolicyOptions())
    assert (policy.name, policy.is_privileged, policy.needs_observation) == ("dapl-pushes", False, True)


def test_killed_and_continued_it_is_the_unbroken_run(unbroken, tmp_path):
    kill_after(3, "tests.dapl_baselines.push_distillation.small_push_distillation", tmp_path / "run")
    assert len(list(make_distillation(tmp_path / "run").run())) > 0
    assert outcome(tmp_path / "run") == outcome(unbroken)


def test_a_student_comes_to_agree_with_its_teacher(tmp_path):
    changes = {"iterations": 10, "updates": 40, "batch": 32, "slots": 8, "learning_rate": 3e-3, "evaluate_every": 99}
    reports = list(make_distillation(tmp_path / "run", SETTINGS.model_copy(update=changes)).run())
    losses = [report.losses for report in reports if report.losses is not None]
    assert losses[-1].regret < 0.5 * losses[0].regret
    assert losses[-1].agreement > losses[0].agreement


def test_the_encoder_stays_as_it_was(unbroken):
    encoder = read_checkpoint(unbroken / "policy.pt").module.encoder.state_dict()
    for name, tensor in make_encoder().module.state_dict().items():
        assert torch.allclose(encoder[name], tensor, atol=1e-3)


def test_a_critic_is_no_student_and_another_scene_no_teachers(tmp_path):
    other = make_distillation(tmp_path / "a")
    list(other.run())
    student = read_checkpoint(tmp_path / "a" / "policy.pt")
    with pytest.raises(InvalidValueError, match="the teacher is a push-student; give one of dapl train teacher"):
        make_distillation(tmp_path / "b", teacher=student)
    teacher = make_teacher(tmp_path)
    teacher.module.config = TEACHER.model_copy(update={"obstacles": 7})
    with pytest.raises(InvalidValueError, match="knows scenes of 8 objects, not of 4"):
        make_distillation(tmp_path / "b", teacher=teacher)
    assert not (tmp_path / "b").exists()


def test_a_folder_of_other_settings_is_refused(unbroken):
    with pytest.raises(InvalidValueError, match=r"other settings \(settings\.batch was 8, is 9\)"):
        make_distillation(unbroken, SETTINGS.model_copy(update={"batch": 9}))


def test_a_damaged_state_is_refused_in_one_line(unbroken, tmp_path):
    state = torch.load(unbroken / "state.pt", weights_only=True)
    state.pop("slots")
    (tmp_path / "x").mkdir()
    (tmp_path / "x" / "run.json").write_text((unbroken / "run.json").read_text())
    torch.save(state, tmp_path / "x" / "state.pt")
    with pytest.raises(InvalidFileError, match="KeyError") as caught:
        make_distillation(tmp_path / "x")
    assert "\n" not in str(caught.value)


def test_the_student_can_be_evaluated(unbroken, tmp_path):
    write_box_scene_set(tmp_path / "scenes", 1)
    where = ["--scenes", str(tmp_path / "scenes"), "--out", str(tmp_path / "out"), "--max-steps", "3"]
    assert run(["evaluate", "--policy", str(unbroken / "policy.pt"), *where, "--threads", "1"]) == 0


def test_the_student_can_be_served_to_a_robot_that_knows_of_no_scene(unbroken):
    served = open_policy(str(unbroken / "policy.pt"))
    try_out(served)
    slots = make_slots()
    observation = {name: rows[0] for name, rows in slots.observe(np.arange(1)).items()}
    served.begin(3)
    actions = np.stack([served.act(3, observation) for _ in range(3)])
    assert actions.shape == (3, 7)
    assert 0.01 < np.abs(actions).max() <= 0.1 + 1e-6


def test_the_command_needs_an_encoder(tmp_path, capsys):
    make_teacher(tmp_path)
    write_box_scene_set(tmp_path / "scenes", 3)
    fixed = ["--teacher", str(tmp_path / "teacher.pt"), "--split", str(tmp_path / "scenes")]
    assert run(["distill-pushes", *fixed, "--encoder", "none", "--out", str(tmp_path / "out")], PROGRAM) == 2
    assert "a student sees points" in capsys.readouterr().err


def test_actions_do_not_depend_on_what_runs_beside(unbroken):
    scenes, config = make_box_scene_set(2), EnvConfig(termination=TerminationConfig(max_steps=12))
    keys = [(scene.scene_id, pair) for scene in scenes.scenes for pair in range(2)]
    found: list[dict[tuple[str, int], np.ndarray]] = []
    for slots in (1, 3):
        policy = load_checkpoint_policy(unbroken / "policy.pt", PolicyOptions())
        runner = EpisodeRunner(scenes, policy, config=config, num_envs=slots, threads=1)
        found.append({(record.row.scene_id, record.row.pair): record.actions for record in runner.run(keys)})
    assert all(np.array_equal(found[0][key], found[1][key]) for key in keys)
