"""A world model and a training small enough for tests; run as a program, it trains and is killed."""

import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import torch

from dapl_baselines.checkpoint import Checkpoint
from dapl_baselines.encoders.dapl import DaplEncoderConfig
from dapl_baselines.interactions.dataset import open_interactions
from dapl_baselines.world_model.batches import BatchConfig
from dapl_baselines.world_model.model import WorldModelConfig
from dapl_baselines.world_model.train_config import RunConfig, TrainConfig
from dapl_baselines.world_model.trainer import Progress, Trainer

TINY_MODEL = WorldModelConfig(
    encoder=DaplEncoderConfig(patch_hidden_sizes=(8, 16), token_size=16, blocks=1, heads=2, mlp_ratio=1)
)


def make_config(data_sha256: str, **changes) -> RunConfig:
    values = {
        "steps": 30,
        "batch": BatchConfig(rows=4),
        "learning_rate": 3e-3,
        "warmup_steps": 3,
        "log_every": 2,
        "save_every": 4,
        "validate_every": 8,
        "validation_clouds": 16,
        "seed": 3,
    }
    return RunConfig(model=TINY_MODEL, train=TrainConfig(**(values | changes)), data_sha256=data_sha256)


def make_trainer(data_folder: Path, out: Path, *, start: Checkpoint | None = None, **changes) -> Trainer:
    torch.set_num_threads(1)
    data = open_interactions([data_folder])
    return Trainer(data, out, make_config(data.sha256, **changes), torch.device("cpu"), start=start)


def die_at(step: int) -> Callable[[Progress], None]:
    """Kills this process when the training is told to be at a step."""

    def show(progress: Progress) -> None:
        if progress.step == step:
            os.kill(os.getpid(), signal.SIGKILL)

    return show


if __name__ == "__main__":
    make_trainer(Path(sys.argv[1]), Path(sys.argv[2])).run(die_at(int(sys.argv[3])))
