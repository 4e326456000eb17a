from pathlib import Path

import numpy as np
import pytest
import torch

from clutter6d.cli import run
from clutter6d.errors import InvalidFileError, InvalidValueError
from dapl_baselines.checkpoint import read_checkpoint
from dapl_baselines.policy.policy import NetworkPolicy
from tests.dapl_baselines.distillation.small_distillation import SETTINGS, TowardsTheGoal, make_distillation
from tests.dapl_baselines.interrupted import curve, kill_after, outcome
from tests.dapl_baselines.policy.networks import STATE_ONLY, make_network
from tests.scene_fixtures import write_box_scene_set

PRIVILEGED = STATE_ONLY.model_copy(update={"state_parts": ("relative_goal", "object_states"), "objects": 4})


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("unbroken") / "run"
    assert [report.iteration for report in make_distillation(folder).run()] == list(range(1, 9))
    return folder


def test_it_leaves_curves_and_a_checkpoint_that_names_the_teacher(unbroken):
    training = curve(unbroken / "training.csv")
    assert [float(row["teacher_share"]) for row in training] == [1, 0.75, 0.5, 0.25, 0, 0, 0, 0]
    assert [int(row["iteration"]) for row in curve(unbroken / "validation.csv")] == [4, 8]
    checkpoint = read_checkpoint(unbroken / "policy.pt")
    record = checkpoint.header.history[-1]
    assert (record.method, record.steps) == ("distillation", 8 * 16)
    assert record.settings["teacher_sha256"] == TowardsTheGoal.policy_hash
    assert not checkpoint.module.config.is_privileged
    assert checkpoint.module.trunk.statistics.count == 8 * 16


def test_killed_and_continued_it_is_the_unbroken_run(unbroken, tmp_path):
    kill_after(5, "tests.dapl_baselines.distillation.small_distillation", tmp_path / "run")
    assert len(list(make_distillation(tmp_path / "run").run())) > 0
    assert outcome(tmp_path / "run") == outcome(unbroken)


def test_a_student_recovers_what_its_teacher_does(tmp_path):
    changes = {"envs": 8, "iterations": 8, "updates": 24, "batch_rows": 64, "replay_rows": 256, "learning_rate": 2e-3}
    reports = list(make_distillation(tmp_path / "run", SETTINGS.model_copy(update=changes)).run())
    losses = [report.losses.action for report in reports]
    assert losses[-1] < 0.02 * losses[0]


def test_a_student_recovers_its_teachers_latent(tmp_path):
    teacher = NetworkPolicy(make_network(PRIVILEGED, seed=1), "1" * 64)
    settings = SETTINGS.model_copy(update={"iterations": 6, "updates": 16, "learning_rate": 2e-3})
    losses = [report.losses.latent for report in make_distillation(tmp_path / "run", settings, teacher=teacher).run()]
    assert losses[-1] < 0.5 * losses[0]


def test_without_the_latent_loss_actions_alone_are_learned(tmp_path):
    teacher = NetworkPolicy(make_network(PRIVILEGED, seed=1), "1" * 64)
    settings = SETTINGS.model_copy(update={"iterations": 1, "latent_weight": 0.0})
    (report,) = make_distillation(tmp_path / "run", settings, teacher=teacher).run()
    assert (report.losses.latent, report.losses.action > 0) == (0, True)
    assert not (tmp_path / "run" / "replay" / "latent.npy").exists()


def test_a_latent_of_another_size_is_refused(tmp_path):
    teacher = NetworkPolicy(make_network(PRIVILEGED.model_copy(update={"fusion_sizes": (8,)})), "1" * 64)
    with pytest.raises(InvalidValueError, match="has 8 numbers, the student's 16; give --latent-weight 0"):
        make_distillation(tmp_path / "run", teacher=teacher)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("trains_encoder", [False, True])
def test_the_encoder_learns_only_if_asked_to(tmp_path, trains_encoder):
    changes = {"iterations": 1, "steps_per_env": 1, "replay_rows": 4, "trains_encoder": trains_encoder}
    distillation = make_distillation(tmp_path / "run", SETTINGS.model_copy(update=changes))
    encoder = distillation._dagger.student.network.encoder
    before = {name: tensor.clone() for name, tensor in encoder.state_dict().items()}
    list(distillation.run())
    after = encoder.state_dict()
    assert any(not torch.equal(after[name], tensor) for name, tensor in before.items()) == trains_encoder
    stored = np.load(tmp_path / "run" / "replay" / "stored.npy", mmap_mode="r")
    assert stored.shape == ((12, 1280, 7) if trains_encoder else (12, 40, 16))


def test_the_student_can_be_evaluated(unbroken, tmp_path):
    write_box_scene_set(tmp_path / "scenes", 1)
    where = ["--scenes", str(tmp_path / "scenes"), "--out", str(tmp_path / "out"), "--max-steps", "2"]
    assert run(["evaluate", "--policy", str(unbroken / "policy.pt"), *where, "--threads", "1"]) == 0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda state: state.update(format="another"), "not the state of this distillation"),
        (lambda state: state.pop("environments"), "KeyError"),
        (lambda state: state["student"]["weights"].popitem(), "RuntimeError"),
    ],
)
def test_a_damaged_state_is_refused_in_one_line(unbroken, tmp_path, change, said):
    state = torch.load(unbroken / "state.pt", weights_only=True)
    change(state)
    (tmp_path / "run.json").write_text((unbroken / "run.json").read_text())
    torch.save(state, tmp_path / "state.pt")
    with pytest.raises(InvalidFileError, match=said) as caught:
        make_distillation(tmp_path)
    assert "\n" not in str(caught.value)
