"""Trainings: they learn, they end when they should, and a kill changes nothing."""

import csv
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from clutter6d.errors import InvalidFileError, InvalidValueError
from dapl_baselines.policy.encoder_source import open_encoder
from dapl_baselines.tensor_file import read_tensor_file, write_tensor_file
from dapl_baselines.world_model.learner import DivergedError
from dapl_baselines.world_model.trained import load_world_model
from tests.dapl_baselines.world_model.tiny import make_trainer


def curve(path: Path) -> np.ndarray:
    """All columns but the clock's."""
    with path.open() as file:
        rows = [{key: float(value) for key, value in row.items() if key != "seconds"} for row in csv.DictReader(file)]
    return np.array([list(row.values()) for row in rows])


@pytest.fixture(scope="module")
def trained(pushed_boxes, tmp_path_factory):
    out = tmp_path_factory.mktemp("trained") / "out"
    make_trainer(pushed_boxes, out).run()
    return out


def test_a_training_leaves_curves_a_state_and_the_best_model(trained):
    losses, validation = curve(trained / "losses.csv"), curve(trained / "validation.csv")
    assert losses[:, 0].tolist() == list(range(2, 31, 2))
    assert validation[:, 0].tolist() == [8, 16, 24, 30]
    model, checkpoint = load_world_model(trained / "world-model.pt")
    best = validation[validation[:, 2].argmin(), 0]
    assert checkpoint.header.history[0].steps == best
    assert checkpoint.header.history[0].settings["train"]["seed"] == 3
    assert not model.training
    assert list((trained / "tensorboard").iterdir())


def test_a_policy_takes_the_encoder_from_the_checkpoint(trained):
    path = trained / "world-model.pt"
    source = open_encoder(str(path), seed=0)
    assert source is not None
    assert source.history[0].method == "world-model"
    seen = torch.rand(2, 1280, 7), torch.rand(2, 9)
    torch.testing.assert_close(source.module.eval()(*seen), load_world_model(path)[0].encoder(*seen))


def test_a_finished_training_is_not_made_again(trained, pushed_boxes):
    before = (trained / "training.pt").read_bytes()
    trainer = make_trainer(pushed_boxes, trained)
    assert trainer.is_over
    trainer.run()
    assert trainer.step == 30
    assert (trained / "training.pt").read_bytes() == before


def test_a_killed_training_goes_on_with_the_same_losses(trained, pushed_boxes, tmp_path):
    """A real kill of a real process, two steps after a save; the unbroken training is this process's."""
    out, root = tmp_path / "out", Path(__file__).parents[3]
    command = [sys.executable, "-m", "tests.dapl_baselines.world_model.tiny", str(pushed_boxes), str(out), "14"]
    environment = {**os.environ, "PYTHONPATH": str(root), "OMP_NUM_THREADS": "1"}
    assert subprocess.run(command, cwd=root, env=environment, timeout=300).returncode == -signal.SIGKILL
    assert curve(out / "losses.csv")[-1, 0] == 14
    with (out / "losses.csv").open("a") as file:
        file.write("16,1.")
    trainer = make_trainer(pushed_boxes, out)
    assert trainer.step == 12
    trainer.run()
    for name in ("losses.csv", "validation.csv"):
        np.testing.assert_allclose(curve(out / name), curve(trained / name), rtol=1e-5)
    whole, broken = (load_world_model(folder / "world-model.pt")[0].state_dict() for folder in (trained, out))
    for name, tensor in whole.items():
        torch.testing.assert_close(broken[name], tensor, msg=name)


def test_an_interrupted_training_loses_no_more_than_a_row_of_its_curve(trained, pushed_boxes, tmp_path):
    def interrupt(progress):
        if progress.step == 12:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_trainer(pushed_boxes, tmp_path / "out").run(interrupt)
    trainer = make_trainer(pushed_boxes, tmp_path / "out")
    assert trainer.step == 10
    trainer.run()
    np.testing.assert_allclose(curve(tmp_path / "out" / "losses.csv"), curve(trained / "losses.csv"), rtol=1e-5)


def test_it_ends_when_held_out_scenes_do_not_get_better(pushed_boxes, tmp_path):
    trainer = make_trainer(pushed_boxes, tmp_path / "out", steps=1000, learning_rate=1e-12, patience=1)
    trainer.run()
    assert trainer.step < 100


def test_it_ends_when_its_time_is_over(pushed_boxes, tmp_path):
    trainer = make_trainer(pushed_boxes, tmp_path / "out", steps=1000, minutes=0.005)
    trainer.run()
    assert trainer.step < 1000
    assert (tmp_path / "out" / "world-model.pt").is_file()


def test_a_loss_that_is_not_finite_ends_it(pushed_boxes, tmp_path):
    trainer = make_trainer(pushed_boxes, tmp_path / "out", learning_rate=1e30, warmup_steps=0, max_gradient_norm=1e30)
    with pytest.raises(DivergedError, match="not finite any more"):
        trainer.run()


def test_other_settings_need_another_folder(trained, pushed_boxes):
    with pytest.raises(InvalidValueError, match="train.seed was 3, is 4"):
        make_trainer(pushed_boxes, trained, seed=4)


def test_a_folder_of_something_else_is_left_alone(pushed_boxes, tmp_path):
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(InvalidValueError, match="neither an empty folder nor a world-model training"):
        make_trainer(pushed_boxes, tmp_path)


@pytest.mark.parametrize("damage", [lambda content: content.pop("step"), lambda content: content["model"].popitem()])
def test_a_damaged_state_is_one_line(pushed_boxes, tmp_path, damage):
    make_trainer(pushed_boxes, tmp_path / "out", steps=4).run()
    content = read_tensor_file(tmp_path / "out" / "training.pt")
    damage(content)
    write_tensor_file(tmp_path / "out" / "training.pt", content)
    with pytest.raises(InvalidFileError, match="not the state of this training"):
        make_trainer(pushed_boxes, tmp_path / "out", steps=4)


def test_a_training_can_begin_with_a_trained_model(trained, pushed_boxes, tmp_path):
    model, start = load_world_model(trained / "world-model.pt")
    make_trainer(pushed_boxes, tmp_path / "out", start=start, steps=2, learning_rate=1e-12).run()
    continued, checkpoint = load_world_model(tmp_path / "out" / "world-model.pt")
    for (name, before), after in zip(model.named_parameters(), continued.parameters(), strict=True):
        torch.testing.assert_close(after, before, rtol=0, atol=1e-8, msg=name)
    assert continued.coordinates.count == model.coordinates.count + 2 * 4 * 1280
    assert checkpoint.header.history[:-1] == start.header.history
    assert checkpoint.header.history[-1].settings["start_sha256"] == start.header.weights_sha256


def test_a_training_begun_with_another_model_needs_another_folder(trained, pushed_boxes, tmp_path):
    _, start = load_world_model(trained / "world-model.pt")
    with pytest.raises(InvalidValueError, match="start_sha256 was , is "):
        make_trainer(pushed_boxes, trained, start=start)
    other = replace(start, header=start.header.model_copy(update={"config": {"task": "object"}}))
    with pytest.raises(InvalidValueError, match="has another configuration"):
        make_trainer(pushed_boxes, tmp_path / "out", start=other)
    assert not (tmp_path / "out").exists()
