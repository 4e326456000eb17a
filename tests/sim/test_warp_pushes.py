"""Trajectories of the two engines are statistically alike; the documentation has the figures of the same script."""

import subprocess
import sys
from pathlib import Path

import pytest

from clutter6d.sim.warp_runtime import torch

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "gpu_parity.py"


@pytest.mark.parametrize(
    "device", [pytest.param("cpu", marks=pytest.mark.slow), pytest.param("cuda", marks=pytest.mark.gpu)]
)
def test_a_hundred_pushes_displace_target_and_obstacles_alike(device):
    if device == "cuda" and not torch.cuda.is_available():
        pytest.skip("no CUDA device")
    command = [sys.executable, str(SCRIPT), "--splits", "sparse-test", "--pushes", "100", "--device", device]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = [line for line in done.stdout.splitlines() if line.startswith(("| target", "| obstacles"))]
    assert len(rows) == 4
    assert "invalid: 0" in done.stdout
    assert "did not fit" not in done.stderr
