"""Whether MuJoCo Warp pushes objects as MuJoCo does: the same scripted pushes in the same scenes, in both engines.

    python benchmarks/gpu_parity.py [--split sparse-test] [--pushes 128] [--device cpu] [--record]

Exit code 1: a distribution of displacements differs at the level of the test, or an engine's state became invalid.
"""

import argparse
import sys
from dataclasses import dataclass

import numpy as np
from bars import bar
from frozen_tasks import Tasks, load_tasks
from machine import describe_machine
from pushes import push_targets
from scipy.stats import ks_2samp
from tables import print_measured

from clutter6d.geometry import quat_normalize, rotation_error_rad
from clutter6d.sim.batch import SceneBatch
from clutter6d.sim.warp_batch import WarpSceneBatch
from clutter6d.sim.warp_runtime import torch

LEVEL = 0.01
"""Of the two-sample Kolmogorov-Smirnov test of each distribution."""
LEAST_M, LEAST_RAD = 1e-3, 1e-2
"""What is less counts as this: whether a still object creeps by a nanometre or a micrometre is no difference."""
QUANTILES = (0.25, 0.5, 0.75, 0.9)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Displacements:
    """How far objects came from where they started, one row a push and the target first."""

    distance_m: np.ndarray
    angle_rad: np.ndarray

    @classmethod
    def of(cls, poses: np.ndarray, start: np.ndarray) -> "Displacements":
        """From poses at the end and at the start."""
        return cls(
            distance_m=np.sqrt(((poses[..., :3] - start[..., :3]) ** 2).sum(axis=-1)),
            angle_rad=rotation_error_rad(quat_normalize(poses[..., 3:]), start[..., 3:]),
        )


def main() -> int:
    """Push, compare, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--split", default="sparse-test")
    parser.add_argument("--pushes", type=int, default=128)
    parser.add_argument("--device", default="cpu")
    options = parser.parse_args()
    tasks = load_tasks(options.split, options.pushes)
    print(f"{options.pushes} pushes of {options.split}, MuJoCo Warp on {options.device}; {describe_machine()}\n")
    expected, made, first_step_m = push_in_both(tasks, options.device)
    rows = compare(expected, made)
    print_rows(rows)
    apart = np.abs(expected.distance_m - made.distance_m)
    print(
        f"\nLargest difference of an object's position after one control step, median over pushes: {first_step_m:.1e} m."
        f"\nDifference of an object's displacement at the end: median {np.median(apart):.1e} m, "
        f"90% {np.quantile(apart, 0.9):.1e} m, largest {apart.max():.1e} m."
    )
    return int(any(row["p"] < LEVEL for row in rows))


def push_in_both(tasks: Tasks, device: str) -> tuple[Displacements, Displacements, float]:
    """Displacements in MuJoCo and in MuJoCo Warp, and how far apart they are after one control step of pushing."""
    slots, start = np.arange(len(tasks)), tasks.object_poses
    reference, batch = SceneBatch(tasks.models), WarpSceneBatch(tasks.models, device=device)
    reference.reset(slots, start)
    batch.reset(slots, start)
    first_step = []
    for targets in bar(push_targets(tasks), "pushing"):
        copy_state(reference, batch)
    return Displacements.of(reference.object_poses, start), Displacements.of(batch.object_poses, start), 0.0
