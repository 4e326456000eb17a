"""What tests of the GPU back end share: their devices, quick compilation, and batches of both engines in one state."""

from collections.abc import Sequence

import numpy as np
import pytest

from clutter6d.scene import GoalPair
from clutter6d.sim.batch import SceneBatch
from clutter6d.sim.scene_model import SceneModel
from clutter6d.sim.warp_batch import WarpSceneBatch
from clutter6d.sim.warp_runtime import torch, warp

DEVICES = ["cpu", pytest.param("cuda", marks=pytest.mark.gpu)]


def compile_quickly() -> None:
    """Compile kernels without optimisation: a minute less at first, ten times slower afterwards."""
    warp.config.optimization_level = 0
    warp.config.cpu_compiler_flags = "-march=native"


def skip_without(device: str) -> str:
    """The device; the test is skipped if it is a CUDA device and there is none."""
    if device == "cuda" and not torch.cuda.is_available():
        pytest.skip("no CUDA device")
    return device


def both_engines(
    models: Sequence[SceneModel], pairs: Sequence[GoalPair], device: str
) -> tuple[SceneBatch, WarpSceneBatch]:
    """MuJoCo's batch and MuJoCo Warp's, at the start of the same tasks."""
    slots, poses = np.arange(len(models)), np.stack([pair.object_poses for pair in pairs])
    reference, batch = SceneBatch(models, threads=1), WarpSceneBatch(models, device=device)
    reference.reset(slots, poses)
    batch.reset(slots, poses)
    return reference, batch


def copy_state(batch: WarpSceneBatch, reference: SceneBatch) -> None:
    """Bring MuJoCo's batch into the state of MuJoCo Warp's."""
    reference.reset(np.arange(batch.size), batch.object_poses.double().cpu().numpy())
    reference.arm_qpos[:] = batch.arm_qpos.cpu().numpy()
    reference.arm_qvel[:] = batch.arm_qvel.cpu().numpy()
    reference.object_velocities[:] = batch.object_velocities.cpu().numpy()
