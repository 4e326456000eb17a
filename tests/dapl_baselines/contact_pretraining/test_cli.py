import pytest

from clutter6d.cli import run
from dapl_baselines.cli import PROGRAM
from tests.dapl_baselines.one_line import assert_one_line


def train(folder, *options: str) -> int:
    fixed = ["--split", str(folder / "scenes"), "--out", str(folder / "run"), "--preset", "small"]
    return run(["train", "corn", *fixed, *options], PROGRAM)


def test_it_trains_and_stops_in_time_and_goes_on(folder, capsys):
    for made in (5, 10):
        assert train(folder, "--max-minutes", "0") == 0
        assert f"{made} of 40 steps are made" in capsys.readouterr().out
    assert train(folder) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "40 of 40 steps are made; the best model is" in said
    assert "nats a patch of held-out objects" in said


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--preset", "labtop"), "unknown preset 'labtop'; did you mean 'laptop'?"),
        (("--steps", "0"), "--steps"),
        (("--split", "sparse-test"), "scenes of sparse-test; train on sparse-train"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(folder, capsys, options, said):
    assert train(folder, *options) == 2
    assert_one_line(capsys.readouterr().err, said)
    assert not (folder / "run").exists()
