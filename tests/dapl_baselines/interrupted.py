"""Trainings that are killed: what they leave, and how it is compared with an unbroken run's."""

import csv
import os
import signal
import subprocess
import sys
from pathlib import Path

from dapl_baselines.checkpoint import read_checkpoint

ROOT = Path(__file__).parents[2]


def curve(path: Path) -> list[dict[str, str]]:
    """A curve's rows, but for the columns that take the time."""
    with path.open() as file:
        return [{k: v for k, v in row.items() if not k.startswith("timing_")} for row in csv.DictReader(file)]


def outcome(folder: Path) -> dict[str, object]:
    """Everything that a training of a policy leaves which must not depend on interruptions."""
    headers = [read_checkpoint(folder / name).header for name in ("policy.pt", "best.pt")]
    return {
        "training": curve(folder / "training.csv"),
        "validation": curve(folder / "validation.csv"),
        "weights": [header.weights_sha256 for header in headers],
        "history": headers[0].history,
    }


def kill_after(iteration: int, module: str, folder: Path) -> None:
    """Run a module that prints the number of each iteration it has made, and kill it after one of them."""
    command = [sys.executable, "-m", module, str(folder)]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if int(line) == iteration:
                process.send_signal(signal.SIGKILL)
                break
    assert process.returncode == -signal.SIGKILL
