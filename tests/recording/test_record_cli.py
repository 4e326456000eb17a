"""The command ``clutter6d record``."""

import json
import signal
import subprocess
import time
from pathlib import Path

import pandas as pd
import pytest

from clutter6d.cli import run
from clutter6d.recording import read_rollouts
from tests.bad_inputs.harness import COMMAND
from tests.recording.recorded import files
from tests.scene_fixtures import write_box_scene_set
from tests.test_docs import ROOT, blocks

PAGE = ROOT / "docs" / "record.md"

POLICY = ["record", "--policy", "random", "--max-steps", "5", "--threads", "1"]
SMALL = ["--width", "48", "--height", "32", "--backend", "raycast"]


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """A folder with ``scenes`` and an evaluation ``results`` of them."""
    folder = tmp_path_factory.mktemp("record")
    write_box_scene_set(folder / "scenes", 3)
    evaluate = ["evaluate", "--policy", "random", "--max-steps", "5", "--threads", "1"]
    assert run([*evaluate, "--scenes", str(folder / "scenes"), "--out", str(folder / "results")]) == 0
    return folder


def test_a_policy_is_run_and_recorded_in_several_formats(made, tmp_path, capsys):
    formats = ["--format", "parquet", "--format", "lerobot", "--format", "gif", "--cameras", "front"]
    out = ["--scenes", str(made / "scenes"), "--episodes", "4", "--out", str(tmp_path)]
    assert run([*POLICY, *formats, *out, *SMALL]) == 0
    assert "recorded 4 episodes in" in capsys.readouterr().out
    keys = [rollout.row.key for rollout in read_rollouts(tmp_path)]
    assert keys == [("boxes-0", 0), ("boxes-0", 1), ("boxes-1", 0), ("boxes-2", 0)]
    assert json.loads((tmp_path / "lerobot" / "meta" / "info.json").read_text())["total_episodes"] == 4
    assert len(list((tmp_path / "gifs").glob("*_front.gif"))) == 4
    assert not list(tmp_path.rglob("*.parts")), "nothing is left over"


def test_an_evaluation_is_recorded_as_it_was(made, tmp_path):
    assert run(["record", str(made / "results"), "--format", "parquet", "--out", str(tmp_path)]) == 0
    evaluated = pd.read_parquet(made / "results" / "episodes.parquet")
    recorded = pd.read_parquet(tmp_path / "rollouts" / "episodes.parquet")
    kept = [name for name in evaluated if not name.startswith("timing_")]
    pd.testing.assert_frame_equal(evaluated[kept], recorded[kept])


def test_a_policy_is_recorded_as_its_evaluation_is(made, tmp_path):
    both = ["--format", "parquet", "--scenes", str(made / "scenes")]
    assert run([*POLICY, *both, "--episodes", "6", "--out", str(tmp_path / "policy")]) == 0
    assert run(["record", str(made / "results"), *both, "--out", str(tmp_path / "evaluation")]) == 0
    assert files(tmp_path / "policy" / "rollouts") == files(tmp_path / "evaluation" / "rollouts")


def test_more_episodes_and_another_format_go_on_from_what_was_run(made, tmp_path):
    common = [*POLICY, "--scenes", str(made / "scenes"), "--out", str(tmp_path)]
    assert run([*common, "--format", "parquet", "--episodes", "2"]) == 0
    journal = {path: path.stat().st_mtime_ns for path in (tmp_path / "episodes" / "journal").iterdir()}
    assert len(journal) == 2
    assert run([*common, "--format", "lerobot", "--cameras", "none", "--episodes", "3"]) == 0
    assert len(list((tmp_path / "episodes" / "journal").iterdir())) == 3
    assert all(path.stat().st_mtime_ns == before for path, before in journal.items())
    assert len(list(read_rollouts(tmp_path))) == 2
    assert not (tmp_path / "lerobot" / "videos").exists()


def test_the_documentations_examples_work(made, tmp_path, monkeypatch, capsys):
    recording = tmp_path / "recordings" / "planner-sparse-test"
    assert run(["record", str(made / "results"), "--format", "parquet", "--out", str(recording)]) == 0
    capsys.readouterr()
    monkeypatch.chdir(tmp_path)
    with_pandas, with_loader = (block for block in blocks(PAGE, "python") if "lerobot" not in block)
    found: dict[str, object] = {}
    exec(compile(with_pandas, PAGE.name, "exec"), found)
    assert len(found["returns"]) == 6
    assert found["poses"].shape == (30, 4, 7)
    exec(compile(with_loader, PAGE.name, "exec"), {})
    assert len(capsys.readouterr().out.splitlines()) == 6


@pytest.mark.slow
def test_a_killed_recording_goes_on_and_is_equal(made, tmp_path):
    common = [*POLICY, "--format", "lerobot", "--scenes", str(made / "scenes"), "--episodes", "6", *SMALL]
    stopped = tmp_path / "stopped"
    process = subprocess.Popen([*COMMAND, *common, "--out", str(stopped)], stdout=subprocess.DEVNULL)
    until = time.monotonic() + 120
    while not list(stopped.glob("lerobot/.parts/*/episode.json")) and time.monotonic() < until:
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    done = list(stopped.glob("lerobot/.parts/*/episode.json"))
    assert 0 < len(done) < 6
    assert run([*common, "--out", str(stopped)]) == 0
    assert run([*common, "--out", str(tmp_path / "whole")]) == 0
    assert files(stopped / "lerobot") == files(tmp_path / "whole" / "lerobot")
