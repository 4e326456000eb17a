import json

import pytest

from clutter6d.cli import run
from dapl_baselines.checkpoint import read_checkpoint
from dapl_baselines.cli import PROGRAM
from tests.dapl_baselines.one_line import assert_one_line


def train(folder, *options: str, out: str = "run") -> int:
    fixed = ["--split", str(folder / "scenes"), "--out", str(folder / out), "--envs", "2", "--threads", "1"]
    return run(["train", "policy", *fixed, *options], PROGRAM)


def test_it_trains_and_stops_in_time_and_goes_on(folder, capsys):
    for made in (1, 2):
        assert train(folder, "--iterations", "3", "--no-physics", "--max-minutes", "0") == 0
        assert f"{made} of 3 iterations are made" in capsys.readouterr().out
    network = json.loads((folder / "run" / "run.json").read_text())["settings"]["network"]
    assert "physics_parameters" not in network["state_parts"]


@pytest.mark.slow
def test_a_finished_training_tells_how_the_policy_does(folder, capsys):
    assert train(folder, "--iterations", "1") == 0
    assert "0.0% of 1 validation episodes succeed" in capsys.readouterr().out
    assert read_checkpoint(folder / "run" / "policy.pt").module.config.encoder is None


def test_a_teacher_sees_the_objects_of_the_scenes(folder):
    assert train(folder, "--iterations", "2", "--objects", "--max-minutes", "0", "--precision", "float16") == 0
    settings = json.loads((folder / "run" / "run.json").read_text())["settings"]
    network = settings["network"]
    assert settings["stored_precision"] == "float16"
    assert (network["objects"], network["state_parts"][-1]) == (4, "object_states")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--preset", "labtop"), "unknown preset 'labtop'; did you mean 'laptop'?"),
        (("--precision", "float8"), "'float8' is not one of 'float32', 'float16'"),
        (("--encoder", "corm"), "unknown encoder 'corm'"),
        (("--encoder", "missing.pt"), "checkpoint not found"),
        (("--device", "tpu"), "device 'tpu' is unknown"),
        (("--envs", "2000000"), "envs is 2000000: Input should be less than or equal to 1048576"),
        (("--split", "sparse-test"), "scenes of sparse-test; train on sparse-train"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(folder, capsys, options, said):
    assert train(folder, *options) == 2
    assert_one_line(capsys.readouterr().err, said)
    assert not (folder / "run").exists()
