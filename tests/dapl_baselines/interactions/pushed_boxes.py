"""A small data set of boxes that are pushed about."""

from pathlib import Path

from clutter6d.eval.evaluator import EvaluationConfig
from clutter6d.eval.policy_loading import load_policy
from clutter6d.eval.runner import EpisodeRunner
from dapl_baselines.interactions.recorder import record_episodes
from dapl_baselines.interactions.recording import Recording
from dapl_baselines.interactions.shards import RecordingHeader
from tests.scene_fixtures import make_box_scene_set


def make_header(**changes) -> RecordingHeader:
    values = {
        "policy": "sweep",
        "policy_hash": "a" * 64,
        "scenes": "boxes",
        "split_sha256": "b" * 64,
        "validation_scenes": ("boxes-2",),
        "objects": 4,
        "seed": 0,
        "max_steps": 40,
        "engine": "test",
        "clutter6d": "test",
    }
    return RecordingHeader(**(values | changes))


def record_pushed_boxes(folder: Path) -> Path:
    """One recording: three scenes, one of them held out, 40 steps each."""
    config = EvaluationConfig(max_steps=40).env()
    scenes = make_box_scene_set(3)
    # Under this seed objects move in every episode.
    runner = EpisodeRunner(scenes, load_policy("sweep"), config=config, num_envs=3, threads=1, seed=3)
    recording = Recording(folder / "sweep", make_header())
    for episode in record_episodes(runner, [("boxes-0", 0), ("boxes-1", 0), ("boxes-2", 0)]):
        recording.add(episode)
    return folder
