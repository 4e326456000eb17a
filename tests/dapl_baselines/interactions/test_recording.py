"""Recordings on disk: what is written is read, what is damaged is refused, and a kill loses nothing."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from clutter6d.cli import run
from clutter6d.errors import InvalidFileError, InvalidValueError, MissingFileError
from clutter6d.eval.evaluator import EvaluationConfig
from clutter6d.eval.policy_loading import load_policy
from clutter6d.eval.runner import EpisodeRunner
from dapl_baselines.cli import PROGRAM
from dapl_baselines.interactions.recorder import record_episodes
from dapl_baselines.interactions.recording import Recording
from dapl_baselines.interactions.shards import RecordingHeader, open_recording, read_scene
from tests.scene_fixtures import make_box_scene, make_box_scene_set, write_box_scene_set

KEYS = [("boxes-0", 0), ("boxes-1", 0), ("boxes-1", 1)]
HEADER = RecordingHeader(
    policy="random",
    policy_hash="a" * 64,
    scenes="boxes",
    split_sha256="b" * 64,
    validation_scenes=("boxes-1",),
    objects=4,
    seed=0,
    max_steps=12,
    engine="test",
    clutter6d="test",
)


@pytest.fixture(scope="module")
def episodes():
    config = EvaluationConfig(max_steps=12).env()
    runner = EpisodeRunner(make_box_scene_set(2), load_policy("random"), config=config, num_envs=3, threads=1)
    return list(record_episodes(runner, KEYS))


@pytest.fixture
def folder(tmp_path, episodes):
    recording = Recording(tmp_path / "recording", HEADER)
    for episode in episodes:
        recording.add(episode)
    return tmp_path / "recording"


def test_what_is_written_is_read(folder, episodes):
    header, (shard,) = open_recording(folder)
    assert header == HEADER
    for entry, episode in zip(shard.episodes, episodes, strict=True):
        assert (entry.scene_id, entry.pair) == episode.key
        np.testing.assert_array_equal(shard.states[entry.rows], episode.states)
        np.testing.assert_array_equal(shard.actions[entry.rows][:-1], episode.actions)
        assert not shard.actions[entry.rows][-1].any()


def test_points_of_a_scene_are_its_assets(folder):
    stored = read_scene(folder, "boxes-1", 4)
    for index, asset in enumerate(make_box_scene(1)[1].assets):
        np.testing.assert_array_equal(stored["points"][index].T, asset.surface_points)
    np.testing.assert_allclose(stored["point_mass"] * 512, 0.3, rtol=1e-6)


def test_a_recording_goes_on_in_the_rows_after_its_last_episode(tmp_path, folder, episodes):
    again = Recording(folder, HEADER)
    assert again.keys == set(KEYS)
    assert again.steps == 36
    again.add(episodes[0])
    _, (shard,) = open_recording(folder)
    assert [entry.first_row for entry in shard.episodes] == [0, 13, 26, 39]


def test_a_full_shard_is_followed_by_another(tmp_path, episodes, monkeypatch):
    for module in ("shards", "recording"):
        monkeypatch.setattr(f"dapl_baselines.interactions.{module}.SHARD_ROWS", 30)
    recording = Recording(tmp_path, HEADER)
    for episode in episodes:
        recording.add(episode)
    _, shards = open_recording(tmp_path)
    assert [len(shard.episodes) for shard in shards] == [2, 1]


def test_rows_that_were_changed_are_refused(folder):
    rows = np.lib.format.open_memmap(folder / "shards/00000/states.npy", mode="r+")
    rows[20, 0] += 1e-9
    rows.flush()
    with pytest.raises(InvalidFileError, match="boxes-1 pair 0 are not those recorded"):
        open_recording(folder)


@pytest.mark.parametrize("content", [b"", b"\x93NUMPY\x01\x00", b"x" * 100])
def test_rows_that_are_no_array_are_refused(folder, content):
    (folder / "shards/00000/actions.npy").write_bytes(content)
    with pytest.raises(InvalidFileError, match=r"actions\.npy: not rows of a recording"):
        open_recording(folder)


def test_an_episode_that_leaves_its_shard_is_refused(folder):
    path = folder / "shards/00000/shard.json"
    header = json.loads(path.read_text())
    header["episodes"][0] |= {"first_row": 16_380}
    path.write_text(json.dumps(header))
    with pytest.raises(InvalidFileError, match="boxes-0 pair 0"):
        open_recording(folder)


def test_a_scene_outside_the_folder_cannot_be_named(folder):
    path = folder / "shards/00000/shard.json"
    path.write_text(path.read_text().replace('"boxes-0"', '"../../boxes-0"'))
    with pytest.raises(InvalidFileError, match="scene_id"):
        open_recording(folder)


def test_other_settings_need_another_folder(folder):
    with pytest.raises(InvalidValueError, match="seed was 0, is 1"):
        Recording(folder, HEADER.model_copy(update={"seed": 1}))


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(InvalidValueError, match="neither an empty folder nor a recording"):
        Recording(tmp_path, HEADER)


def test_no_recording_is_one_line(tmp_path):
    with pytest.raises(MissingFileError, match="recording of interactions not found"):
        open_recording(tmp_path)


def test_test_splits_are_not_recorded(tmp_path, capsys):
    options = ["record", "--policy", "zero", "--scenes", "sparse-test", "--out", str(tmp_path / "out")]
    assert run(options, PROGRAM) == 2
    assert "train on sparse-train" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def recording_command(scenes, out) -> list[str]:
    options = ["--policy", "random", "--scenes", scenes, "--steps", "100000", "--out", out, "--max-steps", "30"]
    return ["record", *map(str, options), "--parallel", "2", "--threads", "1"]


def test_a_killed_recording_goes_on_and_holds_what_an_unbroken_one_does(tmp_path, capsys):
    write_box_scene_set(tmp_path / "scenes", scenes=6)
    program = "from dapl_baselines.cli import main; main()"
    command = [sys.executable, "-c", program, *recording_command(tmp_path / "scenes", tmp_path / "broken")]
    broken = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 200
    while not list((tmp_path / "broken").rglob("shard.json")):
        assert time.monotonic() < deadline
        assert broken.poll() is None, broken.stderr.read()
        time.sleep(0.005)
    os.kill(broken.pid, signal.SIGKILL)
    broken.communicate()
    recorded = {}
    for name in ("broken", "whole"):
        assert run(recording_command(tmp_path / "scenes", tmp_path / name), PROGRAM) == 0
        said = capsys.readouterr().out
        assert "360 steps of 12 episodes" in said
        assert "all episodes of these scenes are recorded" in said
        (found,) = (tmp_path / name).iterdir()
        _, shards = open_recording(found)
        recorded[name] = [(e.scene_id, e.pair, e.sha256) for shard in shards for e in shard.episodes]
    assert recorded["broken"] == recorded["whole"]
