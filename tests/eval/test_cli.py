import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from clutter6d.cli import run
from tests.scene_fixtures import write_box_scene_set

EVALUATE = ["evaluate", "--policy", "random", "--max-steps", "6", "--num-envs", "3", "--threads", "1"]


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """A folder with ``scenes`` and an evaluation ``out``."""
    folder = tmp_path_factory.mktemp("cli")
    write_box_scene_set(folder / "scenes")
    assert run([*EVALUATE, "--scenes", str(folder / "scenes"), "--out", str(folder / "out")]) == 0
    return folder


@pytest.fixture
def folder(made, tmp_path) -> Path:
    shutil.copytree(made, tmp_path / "work")
    return tmp_path / "work"


def test_evaluate_writes_the_tables(made):
    names = {path.name for path in (made / "out").iterdir()}
    assert {"episodes.parquet", "actions.parquet", "report.json", "report.md", "run.json"} <= names
    assert len(pd.read_parquet(made / "out" / "episodes.parquet")) == 4
    assert json.loads((made / "out" / "report.json").read_text())["episodes"] == 4


def test_evaluate_prints_the_table_with_n_and_intervals(folder, capsys):
    assert run([*EVALUATE, "--scenes", str(folder / "scenes"), "--out", str(folder / "out"), "--threads", "2"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    for needed in ("n = 4", "Wilson", "zero action (floor)", "not official"):
        assert needed in shown


def test_replay_confirms_an_honest_evaluation(folder, capsys):
    assert run(["replay", str(folder / "out"), "--scenes", str(folder / "scenes"), "--threads", "1"]) == 0
    assert "4 of 4 episodes identical to the bit" in capsys.readouterr().out


def test_replay_finds_the_scenes_where_they_were(made):
    assert run(["replay", str(made / "out"), "--threads", "1"]) == 0


def test_replay_ends_with_1_where_an_outcome_was_changed(folder, capsys):
    path = folder / "out" / "episodes.parquet"
    frame = pd.read_parquet(path)
    frame.loc[2, "mean_offset_cm"] = 0.0
    frame.to_parquet(path, index=False)
    assert run(["replay", str(folder / "out"), "--threads", "1"]) == 1
    shown = " ".join(capsys.readouterr().out.split())
    assert "boxes-1 pair 0: DIFFERS in mean_offset_cm" in shown
    assert "3 of 4 episodes identical" in shown


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (["--policy", "nothing"], "unknown policy 'nothing'"),
        (["--policy", "bomb.pt"], "checkpoint not found"),
        (["--scenes", "nowhere"], "unknown folder of scenes or split 'nowhere'"),
        (["--seed", "1"], "other settings (seed was 0, is 1)"),
        (["--num-envs", "0"], "--num-envs"),
    ],
)
def test_a_users_mistake_is_one_line_and_exit_code_2_and_leaves_results_intact(folder, capsys, changed, said):
    before = {path: path.read_bytes() for path in (folder / "out").rglob("*") if path.is_file()}
    assert run([*EVALUATE, "--scenes", str(folder / "scenes"), "--out", str(folder / "out"), *changed]) == 2
    assert said in capsys.readouterr().err
    assert before == {path: path.read_bytes() for path in (folder / "out").rglob("*") if path.is_file()}


def test_replaying_what_is_no_evaluation_is_explained(tmp_path, capsys):
    assert run(["replay", str(tmp_path / "nowhere")]) == 2
    assert "make one with: clutter6d evaluate" in capsys.readouterr().err


def test_a_missing_asset_is_named(folder, capsys):
    shutil.rmtree(next((folder / "scenes" / "library" / "assets").iterdir()))
    code = run([*EVALUATE, "--scenes", str(folder / "scenes"), "--out", str(folder / "new")])
    error = capsys.readouterr().err
    assert code == 2
    assert error.count("\n") == 1


def count_episodes(out: Path) -> int:
    return len(list(out.glob("journal/*@*.json")))


def test_an_evaluation_that_is_killed_outright_loses_no_finished_episode(tmp_path):
    write_box_scene_set(tmp_path / "scenes", 4)
    out = tmp_path / "out"
    arguments = ["evaluate", "--policy", "random", "--scenes", str(tmp_path / "scenes"), "--out", str(out)]
    arguments += ["--num-envs", "1", "--threads", "1", "--max-steps", "40"]
    command = [sys.executable, "-c", "from clutter6d.cli import main; main()", *arguments]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 60
        while count_episodes(out) < 2 and time.monotonic() < deadline:
            time.sleep(0.005)
        process.kill()
    kept = count_episodes(out)
    assert 2 <= kept < 8
    times = {path: path.stat().st_mtime_ns for path in out.glob("journal/*@*.json")}
    assert run(arguments) == 0
    assert count_episodes(out) == 8
    assert all(path.stat().st_mtime_ns == stamp for path, stamp in times.items())
    assert run(["replay", str(out), "--threads", "1"]) == 0
