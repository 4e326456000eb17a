"""Recorded data sets, opened by LeRobot itself in an environment of its own: ``make test-lerobot``."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from clutter6d.dataset.scenes import load_split
from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.eval.policy_loading import load_policy
from clutter6d.recording.cameras import take_pictures
from clutter6d.recording.lerobot_features import IMAGE_PREFIX, frame_arrays
from clutter6d.recording.lerobot_recorder import LeRobotRecorder
from clutter6d.recording.recording import RecordingSettings, record_episodes
from clutter6d.recording.source import read_evaluation
from tests.test_docs import ROOT, blocks

CHECK, PAGE = ROOT / "examples" / "check_lerobot_dataset.py", ROOT / "docs" / "record.md"
PYTHON = os.environ.get("CLUTTER6D_LEROBOT_PYTHON", "")
CAMERAS = ("front", "left", "right")
SIZE = {"width": 320, "height": 240}

pytestmark = [
    pytest.mark.lerobot,
    pytest.mark.skipif(not PYTHON, reason="CLUTTER6D_LEROBOT_PYTHON names no Python with LeRobot"),
]


class Keeping(LeRobotRecorder):
    """Also keeps what goes into the data set, to be compared with what LeRobot takes out of it."""

    def add(self, rollout, scene, model):
        self.kept = [*getattr(self, "kept", []), (rollout, model)]
        super().add(rollout, scene, model)


def record(tmp_path, *, point_clouds: bool) -> LeRobotRecorder:
    """Five random episodes of real scenes, 30 to 35 frames in all."""
    scenes = load_split("sparse-test")
    evaluation = Evaluation(scenes, load_policy("random"), tmp_path / "evaluation", EvaluationConfig(max_steps=7))
    list(evaluation.run(keys=evaluation.keys[:80:16], threads=1))
    episodes = read_evaluation(tmp_path / "evaluation", scenes)
    settings = RecordingSettings(run=episodes.settings, point_clouds=point_clouds, cameras=CAMERAS, fps=10, **SIZE)
    recorder = Keeping(tmp_path / "lerobot", settings, episodes.keys)
    list(record_episodes(episodes, [recorder], point_clouds=point_clouds))
    recorder.finish()
    return recorder


def write_expected(path: Path, recorder: LeRobotRecorder) -> None:
    """What LeRobot must give, taken from the simulation and drawn once more."""
    arrays = [frame_arrays(rollout) for rollout, _ in recorder.kept]
    expected = {f"frames/{name}": np.concatenate([item[name] for item in arrays]) for name in arrays[0]}
    for camera in CAMERAS:
        pictures = [list(take_pictures(rollout, model, camera, **SIZE)) for rollout, model in recorder.kept]
        expected[f"pictures/{IMAGE_PREFIX}{camera}"] = np.concatenate(pictures)
    count = len(expected["frames/action"])
    np.savez(path, allow_pickle=False, picture_index=np.arange(count), **expected)


@pytest.mark.parametrize("point_clouds", [False, True], ids=["states", "clouds"])
def test_lerobot_gives_back_what_was_recorded(tmp_path, point_clouds):
    recorder = record(tmp_path, point_clouds=point_clouds)
    write_expected(tmp_path / "expected.npz", recorder)
    command = [PYTHON, str(CHECK), str(tmp_path / "lerobot"), "--expected", str(tmp_path / "expected.npz")]
    environment = os.environ | {"HF_HUB_OFFLINE": "1", "HF_HOME": str(tmp_path / "cache")}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    print(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr[-2000:]
    assert "LeRobot opens lerobot: 5 episodes" in done.stdout
    for name in ("observation.state", "action", "next.reward"):
        assert f"ok  {name} is what was recorded" in done.stdout
    for camera in CAMERAS:
        assert f"ok  {IMAGE_PREFIX}{camera} decodes to what was drawn" in done.stdout
        assert f"ok  {IMAGE_PREFIX}{camera} shows every frame in its place" in done.stdout
    check_documented_example(tmp_path, environment)


def check_documented_example(tmp_path: Path, environment: dict[str, str]) -> None:
    (tmp_path / "recordings" / "planner-sparse-test").mkdir(parents=True)
    (tmp_path / "recordings" / "planner-sparse-test" / "lerobot").symlink_to(tmp_path / "lerobot")
    (example,) = (block for block in blocks(PAGE, "python") if "lerobot" in block)
    command = [PYTHON, "-c", example]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "torch.Size([39]) torch.Size([3, 240, 320])" in done.stdout
