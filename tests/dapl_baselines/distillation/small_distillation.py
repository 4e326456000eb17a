"""A distillation that takes seconds; as a script, ``small_distillation.py FOLDER``, so that it can be killed."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from clutter6d.eval.policy import Episode, PolicyInput, PolicyOptions, identity_hash
from dapl_baselines.distillation.settings import STUDENT_STATE, DistillationSettings
from dapl_baselines.distillation.training import Distillation
from dapl_baselines.encoders.dapl import DaplEncoder
from dapl_baselines.policy.encoder_source import EncoderSource
from dapl_baselines.validation import part_scenes
from tests.dapl_baselines.policy.networks import SMALL_ENCODER, STATE_ONLY
from tests.scene_fixtures import make_box_scene_set

SETTINGS = DistillationSettings(
    network=STATE_ONLY.model_copy(update={"state_parts": STUDENT_STATE, "history": 3}),
    envs=4,
    steps_per_env=4,
    iterations=8,
    teacher_iterations=4,
    replay_rows=40,
    updates=2,
    batch_rows=16,
    max_steps=6,
    evaluate_every=4,
)


class TowardsTheGoal:
    """Turns the first joint towards the goal, and bows with the target's distance, which only the points tell."""

    name, policy_hash = "towards-the-goal", identity_hash("towards-the-goal")
    is_privileged, needs_observation = False, True

    def __init__(self, options: PolicyOptions | None = None) -> None:
        self.begun: list[int] = []

    def begin(self, slots: np.ndarray, episodes: Sequence[Episode]) -> None:
        self.begun += slots.tolist()

    def act(self, inputs: PolicyInput) -> np.ndarray:
        assert inputs.observation is not None
        target = inputs.observation["object_points"][..., :3].mean(axis=1)
        actions = np.zeros((len(inputs.slots), 7), dtype=np.float32)
        actions[:, 0] = np.clip(0.5 * inputs.observation["relative_goal"][:, 1], -0.1, 0.1)
        actions[:, 1] = np.clip(0.2 * target[:, 0], -0.1, 0.1)
        return actions


def make_encoder() -> EncoderSource:
    with torch.random.fork_rng():
        torch.manual_seed(0)
        return EncoderSource(config=SMALL_ENCODER, module=DaplEncoder(SMALL_ENCODER))


def make_distillation(out: Path, settings: DistillationSettings = SETTINGS, **options: Any) -> Distillation:
    chosen: dict[str, Any] = {"teacher": TowardsTheGoal(), "encoder": make_encoder()} | options
    return Distillation(part_scenes(make_box_scene_set(3)), settings, out, threads=1, **chosen)


if __name__ == "__main__":
    for report in make_distillation(Path(sys.argv[1])).run():
        print(report.iteration, flush=True)
