"""A teacher's training that takes seconds; as a script, ``small_teacher.py FOLDER``, so that it can be killed."""

import sys
from pathlib import Path
from typing import Any

from dapl_baselines.push_policy.critic import PushCriticConfig
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.teacher.settings import TeacherSettings
from dapl_baselines.teacher.training import TeacherTraining
from dapl_baselines.validation import SceneSubset, part_scenes
from tests.scene_fixtures import make_box_scene_set

SETTINGS = TeacherSettings(
    critic=PushCriticConfig(point_sizes=(8, 8), hidden_size=16, segments=4, whole_pushes=4),
    slots=4,
    random_slots=0.25,
    practice_segments=3,
    practice_pushes=3,
    future_segments=2,
    future_pushes=2,
    steps=10,
    updates=2,
    batch=16,
    iterations=8,
    warm_up=4,
    kept=1_000,
    learning_rate=1e-2,
    save_every=2,
    evaluate_every=4,
    max_steps=25,
)


def small_scenes() -> SceneSubset:
    """Two scenes to practise on."""
    return part_scenes(make_box_scene_set(3)).training


def small_shapes() -> TargetShapes:
    """The shapes of their targets."""
    scenes = small_scenes()
    return TargetShapes.of(scenes.assets_of(scene)[scene.objects[0].asset_hash] for scene in scenes.scenes)


def make_training(out: Path, settings: TeacherSettings = SETTINGS, **options: Any) -> TeacherTraining:
    return TeacherTraining(part_scenes(make_box_scene_set(3)), settings, out, threads=1, **options)


if __name__ == "__main__":
    for report in make_training(Path(sys.argv[1])).run():
        print(report.iteration, flush=True)
