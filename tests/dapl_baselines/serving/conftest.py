"""Policies to export and serve: with and without points, with weights that make the actions large."""

import subprocess
import sys
from functools import cache

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from dapl_baselines.checkpoint import write_checkpoint  # noqa: E402
from dapl_baselines.encoders.corn import CornEncoderConfig  # noqa: E402
from dapl_baselines.encoders.dapl import DaplEncoderConfig  # noqa: E402
from dapl_baselines.policy.config import PolicyNetworkConfig  # noqa: E402
from dapl_baselines.policy.network import PolicyNetwork  # noqa: E402

DAPL = (sys.executable, "-c", "from dapl_baselines.cli import main; main()")
"""The console script, wherever it is installed."""

STUDENT = ("hand_state", "joint_state", "relative_goal", "previous_action")
CONFIGS = {
    "state": PolicyNetworkConfig(state_parts=STUDENT, fusion_sizes=(64, 32), head_sizes=(16,)),
    "memory": PolicyNetworkConfig(state_parts=STUDENT, fusion_sizes=(64, 32), head_sizes=(16,), history=3),
    "points": PolicyNetworkConfig(
        encoder=DaplEncoderConfig(token_size=16, blocks=1, heads=2, patch_hidden_sizes=(8, 16)),
        state_parts=STUDENT,
        fusion_sizes=(32,),
        head_sizes=(16,),
    ),
    "target-points": PolicyNetworkConfig(
        encoder=CornEncoderConfig(token_size=16, heads=2, patch_hidden_size=16),
        state_parts=STUDENT,
        fusion_sizes=(32,),
        head_sizes=(16,),
    ),
}


@pytest.fixture(scope="session")
def checkpoints(tmp_path_factory):
    """Checkpoints by name."""
    folder, made = tmp_path_factory.mktemp("checkpoints"), {}
    for name, config in CONFIGS.items():
        with torch.random.fork_rng():
            torch.manual_seed(0)
            network = PolicyNetwork(config)
        with torch.no_grad():
            network.actor[-1].weight.mul_(10)
        made[name] = folder / f"{name}.pt"
        write_checkpoint(made[name], architecture="policy-network", config=config, module=network)
    return made


@pytest.fixture(scope="session")
def export(checkpoints, tmp_path_factory):
    """Exports a checkpoint in both formats, once; by a process of its own, as checked types do not survive tracing."""
    root = tmp_path_factory.mktemp("exported")

    @cache
    def export_once(name):
        command = [*DAPL, "export", checkpoints[name], "--out", root / name]
        done = subprocess.run(command, capture_output=True, text=True, timeout=600)
        assert (done.returncode, done.stderr) == (0, "")
        return root / name

    return export_once


@pytest.fixture
def observation():
    """One robot's observation of plausible size."""
    from clutter6d.envs.observation import OBSERVATION_SHAPES

    rng = np.random.default_rng(1)
    return {name: rng.normal(scale=0.2, size=shape).astype(np.float32) for name, shape in OBSERVATION_SHAPES.items()}
