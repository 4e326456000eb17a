"""A policy training that takes seconds; as a script, ``small_training.py FOLDER``, so that it can be killed."""

import sys
from pathlib import Path
from typing import Any

import torch

from dapl_baselines.encoders.dapl import DaplEncoder
from dapl_baselines.policy.encoder_source import EncoderSource
from dapl_baselines.policy.settings import PpoSettings, TrainingSettings
from dapl_baselines.policy.training import PolicyTraining
from dapl_baselines.validation import part_scenes
from tests.dapl_baselines.policy.networks import SMALL_ENCODER, STATE_ONLY
from tests.scene_fixtures import make_box_scene_set

SETTINGS = TrainingSettings(
    network=STATE_ONLY,
    ppo=PpoSettings(num_learning_epochs=2, num_mini_batches=2, learning_rate=1e-3),
    envs=4,
    steps_per_env=4,
    iterations=10,
    curriculum_iterations=8,
    evaluate_every=4,
    max_steps=6,
)


def make_training(out: Path, settings: TrainingSettings = SETTINGS, **options: Any) -> PolicyTraining:
    with torch.random.fork_rng():
        torch.manual_seed(0)
        encoder = EncoderSource(config=SMALL_ENCODER, module=DaplEncoder(SMALL_ENCODER))
    scenes = part_scenes(make_box_scene_set(3))
    return PolicyTraining(scenes, settings, out, encoder=encoder, threads=1, **options)


if __name__ == "__main__":
    for report in make_training(Path(sys.argv[1]), save_seconds=0).run():
        print(report.iteration, flush=True)
