"""A distillation of pushes that takes seconds; as a script, ``small_push_distillation.py FOLDER``, to be killed."""

import sys
from pathlib import Path
from typing import Any

from dapl_baselines.checkpoint import Checkpoint, read_checkpoint, write_checkpoint
from dapl_baselines.push_distillation.settings import PushDistillationSettings
from dapl_baselines.push_distillation.training import PushDistillation
from dapl_baselines.push_policy.critic import PushCriticConfig
from dapl_baselines.push_policy.student import PushStudentConfig
from dapl_baselines.validation import part_scenes
from tests.dapl_baselines.distillation.small_distillation import make_encoder
from tests.dapl_baselines.policy.networks import SMALL_ENCODER
from tests.dapl_baselines.push_policy.test_critic import make_critic
from tests.scene_fixtures import make_box_scene_set

TEACHER = PushCriticConfig(point_sizes=(8, 8), hidden_size=16)
SIZES = {"point_sizes": (8, 8), "hidden_size": 16, "segments": 3, "whole_pushes": 3, "obstacles": 0}
SETTINGS = PushDistillationSettings(
    student=PushStudentConfig(critic=PushCriticConfig(**SIZES), encoder=SMALL_ENCODER, attention_heads=2),
    slots=3,
    teacher_iterations=4,
    segments=3,
    whole_pushes=3,
    steps=8,
    updates=2,
    batch=8,
    iterations=6,
    warm_up=6,
    kept=2_000,
    save_every=2,
    evaluate_every=3,
    max_steps=20,
)


def make_teacher(folder: Path) -> Checkpoint:
    """A teacher with random weights."""
    path = folder / "teacher.pt"
    write_checkpoint(path, architecture="push-critic", config=TEACHER, module=make_critic(TEACHER))
    return read_checkpoint(path)


def make_distillation(out: Path, settings: PushDistillationSettings = SETTINGS, **options: Any) -> PushDistillation:
    chosen = {"teacher": make_teacher(out.parent), "encoder": make_encoder()} | options
    return PushDistillation(part_scenes(make_box_scene_set(3)), settings, out, threads=1, **chosen)


if __name__ == "__main__":
    for report in make_distillation(Path(sys.argv[1])).run():
        print(report.iteration, flush=True)
