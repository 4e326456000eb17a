"""Small recordings that tests look at: boxes, a few steps, small pictures."""

from pathlib import Path

import numpy as np

from clutter6d.eval.builtin_policies import RandomPolicy
from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.eval.policy import identity_hash
from clutter6d.recording.recording import RecordingSettings
from clutter6d.recording.source import RecordedEpisodes, read_evaluation
from tests.eval.scripted import scenes_with_known_outcomes
from tests.scene_fixtures import BoxSceneSet, make_box_scene_set

STEPS = 6
"""Of an episode that runs to its end."""
SIZE = {"width": 48, "height": 32}


def evaluate(folder: Path, scenes: BoxSceneSet, *, is_finished: bool = True) -> RecordedEpisodes:
    """Run random actions on scenes, as ``clutter6d evaluate`` does, and open what was recorded."""
    policy = RandomPolicy(scale_rad=0.1, policy_hash=identity_hash("random-test"))
    evaluation = Evaluation(scenes, policy, folder, EvaluationConfig(max_steps=STEPS))
    for part in ("journal", "floor") if is_finished else ("journal",):
        list(evaluation.run(part, num_envs=2, threads=1))
    if is_finished:
        evaluation.finish()
    return read_evaluation(folder, scenes)


def random_episodes(folder: Path, scenes: int = 2) -> RecordedEpisodes:
    """Episodes that end by timeout: two pairs of each scene."""
    return evaluate(folder, make_box_scene_set(scenes))


def known_episodes(folder: Path) -> RecordedEpisodes:
    """Episodes of three scenes; pair 0 succeeds in its first step, in pair 1 an object drops."""
    return evaluate(folder, scenes_with_known_outcomes())


def picture_settings(episodes: RecordedEpisodes, *cameras: str, **others) -> RecordingSettings:
    """Settings of small pictures."""
    return RecordingSettings(run=episodes.settings, cameras=cameras, fps=10, **SIZE, **others)


def files(folder: Path) -> dict[str, bytes]:
    """What a folder holds."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def stacked(column) -> np.ndarray:
    """A column of lists as one array."""
    return np.stack(column.to_numpy())
