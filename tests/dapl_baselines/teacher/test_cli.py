import json

import pytest

from clutter6d.cli import run
from dapl_baselines.cli import PROGRAM
from tests.dapl_baselines.one_line import assert_one_line


def train(folder, *options: str) -> int:
    fixed = ["--split", str(folder / "scenes"), "--out", str(folder / "run"), "--threads", "1"]
    return run(["train", "teacher", *fixed, *options], PROGRAM)


def test_it_trains_and_stops_in_time_and_goes_on(folder, capsys):
    for _ in range(2):
        assert train(folder, "--preset", "small", "--max-minutes", "0") == 0
        assert "1 of 20 iterations are made" in capsys.readouterr().out
    settings = json.loads((folder / "run" / "run.json").read_text())["settings"]
    assert settings["critic"]["obstacles"] == 3


def test_its_help_names_the_presets(capsys):
    assert run(["train", "teacher", "--help"], PROGRAM) == 0
    assert "laptop or small" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--preset", "labtop"), "unknown preset 'labtop'; did you mean 'laptop'?"),
        (("--iterations", "0"), "--iterations"),
        (("--split", "sparse-test"), "scenes of sparse-test; train on sparse-train"),
        (("--split", "missing"), "missing"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(folder, capsys, options, said):
    assert train(folder, *options) == 2
    assert_one_line(capsys.readouterr().err, said)
    assert not (folder / "run").exists()


def test_another_training_in_the_folder_is_one_line(folder, capsys):
    assert train(folder, "--preset", "small", "--max-minutes", "0") == 0
    capsys.readouterr()
    assert train(folder, "--preset", "small", "--max-minutes", "0", "--seed", "1") == 2
    assert_one_line(capsys.readouterr().err, "settings.seed was 0, is 1")
