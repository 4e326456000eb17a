"""A curriculum that takes seconds, as a command; as a script, it kills itself in the midst of a stage."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import torch

from clutter6d.cli import run
from clutter6d.progress import BarsByName
from dapl_baselines.cli import PROGRAM
from dapl_baselines.curriculum import cli
from dapl_baselines.curriculum.settings import PRESETS, CurriculumSettings
from dapl_baselines.world_model import final_report
from dapl_baselines.world_model.batches import BatchConfig
from dapl_baselines.world_model.train_config import TrainConfig
from tests.dapl_baselines.policy.small_training import SETTINGS as POLICY

SETTINGS = CurriculumSettings(
    rounds=2,
    record_steps=200,
    record_max_steps=40,
    random_share=0.2,
    train=TrainConfig(
        steps=8, batch=BatchConfig(rows=4), log_every=2, save_every=4, validate_every=8, validation_clouds=16
    ),
    policy=POLICY.model_copy(update={"iterations": 4, "envs": 2}),
)
"""``--preset small``."""


def run_command(folder: Path, out: str, *options: str) -> int:
    """``dapl curriculum`` on the scenes in a folder; returns its exit code."""
    where = ["--scenes", str(folder / "scenes"), "--out", str(folder / out), "--threads", "1"]
    chosen = ["--preset", "small", "--model", str(folder / "tiny.json"), *where, *options]
    with pytest.MonkeyPatch.context() as patch, one_thread():
        patch.setitem(PRESETS, "small", SETTINGS)
        patch.setattr(final_report, "HELD_OUT_CLOUDS", 24)
        patch.setattr(final_report, "TRAINED_ON_CLOUDS", 4)
        return run(["curriculum", *chosen], PROGRAM)


@contextmanager
def one_thread() -> Iterator[None]:
    """Sums come in the same order in every process."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


class DeadlyBars(BarsByName):
    """Kills this process when a stage is as far as the environment variable ``DIE_AT`` says."""

    def update(self, name: str, done: int, total: int) -> None:
        super().update(name, done, total)
        stage, _, most = os.environ["DIE_AT"].rpartition(" ")
        if name == stage and done >= int(most):
            os.kill(os.getpid(), signal.SIGKILL)


if __name__ == "__main__":
    cli.BarsByName = DeadlyBars
    run_command(Path(sys.argv[1]), sys.argv[2])
