import json

import pytest

from clutter6d.cli import run
from dapl_baselines.checkpoint import write_checkpoint
from dapl_baselines.cli import PROGRAM
from tests.dapl_baselines.one_line import assert_one_line
from tests.dapl_baselines.policy.networks import WITH_POINTS, make_network


def distill(folder, *options: str) -> int:
    fixed = ["--split", str(folder / "scenes"), "--out", str(folder / "run"), "--envs", "1", "--threads", "1"]
    return run(["distill", *fixed, *options], PROGRAM)


@pytest.mark.slow
def test_it_distils_and_stops_in_time_and_goes_on(folder, capsys):
    path = folder / "encoder.pt"
    write_checkpoint(path, architecture="policy-network", config=WITH_POINTS, module=make_network(WITH_POINTS))
    for made in (1, 2):
        command = ["--teacher", "zero", "--encoder", str(path), "--history", "2", "--max-minutes", "0"]
        assert distill(folder, *command) == 0
        assert f"{made} of 1000 iterations are made" in capsys.readouterr().out
    assert json.loads((folder / "run" / "run.json").read_text())["settings"]["network"]["history"] == 2


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--teacher", "zero", "--encoder", "none"), "a student sees points"),
        (("--teacher", "zeor", "--encoder", "dapl"), "did you mean 'zero'?"),
        (("--teacher", "zero", "--encoder", "missing.pt"), "checkpoint not found"),
        (("--teacher", "zero", "--encoder", "dapl", "--preset", "labtop"), "did you mean 'laptop'?"),
        (("--teacher", "zero", "--encoder", "dapl", "--split", "sparse-test"), "scenes of sparse-test"),
        (("--teacher", "zero", "--encoder", "dapl", "--history", "17"), "--history"),
        (("--encoder", "dapl"), "--teacher"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(folder, capsys, options, said):
    assert distill(folder, *options) == 2
    assert_one_line(capsys.readouterr().err, said)
    assert not (folder / "run").exists()
