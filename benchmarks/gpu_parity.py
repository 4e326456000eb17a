"""Whether MuJoCo Warp pushes objects as MuJoCo does: the same scripted pushes of the same scenes in both engines.

    python benchmarks/gpu_parity.py [--pushes 128] [--splits sparse-test,...] [--device cpu] [--record]

Exit code 1: a distribution of displacements differs at the level of the test, or an engine's state became invalid.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from bars import bar
from frozen_tasks import Tasks, load_tasks
from pushes import push_targets
from scipy.stats import ks_2samp
from tables import Report, add_record_option

from clutter6d.geometry import quat_normalize, rotation_error_rad
from clutter6d.sim.batch import SceneBatch
from clutter6d.sim.warp_batch import WarpSceneBatch
from clutter6d.sim.warp_runtime import torch

LEVEL = 0.01
"""Of each two-sample Kolmogorov-Smirnov test."""
LEAST = {"m": 1e-3, "rad": 1e-2}
"""What is less counts as this: whether a still object creeps by a nanometre or a micrometre is no difference."""
QUANTILES = (0.5, 0.75, 0.9)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Pushed:
    """What came of pushes, one row a push.

    Attributes:
        expected: Final object poses in MuJoCo.
        made: Final object poses in MuJoCo Warp.
        one_step_m: How far apart the engines put the objects in each control step from the same state; largest of a
            scene, one row a step.
        contacts: Most contacts, or near pairs of geoms, at the end of a control step, on average over the worlds.
        constraints: Most rows of constraints of a world at the end of a control step.
        unstable: Worlds that became invalid in either engine.
    """

    expected: np.ndarray
    made: np.ndarray
    one_step_m: np.ndarray
    contacts: float
    constraints: int
    unstable: int


def push(tasks: Tasks, device: str) -> Pushed:
    """Play the same joint targets in both engines."""
    slots = np.arange(len(tasks))
    reference, twin = SceneBatch(tasks.models), SceneBatch(tasks.models)
    batch = WarpSceneBatch(tasks.models, device=device)
    for each in (reference, batch):
        each.reset(slots, tasks.object_poses)
    apart, contacts, constraints = [], 0, 0
    for targets in bar(push_targets(tasks), "pushing"):
        copy_state(batch, twin)
        for each in (reference, twin):
            each.joint_targets[:] = targets
        batch.joint_targets.copy_(torch.from_numpy(targets))
        for each in (reference, twin, batch):
            each.step()
        apart.append(distances_m(twin.object_poses, poses_of(batch)).max(axis=1))
        contacts = max(contacts, *batch.contacts_in_use())
        constraints = max(constraints, batch.constraints_in_use())
    return Pushed(
        expected=reference.object_poses,
        made=poses_of(batch),
        one_step_m=np.stack(apart),
        contacts=contacts / len(tasks),
        constraints=constraints,
        unstable=len(reference.unstable_slots()) + len(batch.unstable_slots()),
    )


def copy_state(batch: WarpSceneBatch, reference: SceneBatch) -> None:
    """Bring MuJoCo into the state of MuJoCo Warp."""
    reference.reset(np.arange(batch.size), poses_of(batch))
    for name in ("arm_qpos", "arm_qvel", "object_velocities"):
        getattr(reference, name)[:] = getattr(batch, name).cpu().numpy()


def poses_of(batch: WarpSceneBatch) -> np.ndarray:
    """Object poses in float64, with unit quaternions."""
    poses = batch.object_poses.double().cpu().numpy()
    poses[..., 3:] = quat_normalize(poses[..., 3:])
    return poses


def distances_m(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distances between positions of poses."""
    return np.sqrt(((a[..., :3] - b[..., :3]) ** 2).sum(axis=-1))


def displacements(poses: np.ndarray, start: np.ndarray) -> dict[tuple[str, str], np.ndarray]:
    """How far targets and obstacles came, by whose and unit."""
    moved = {"m": distances_m(poses, start), "rad": rotation_error_rad(poses[..., 3:], start[..., 3:])}
    whose = {"target": slice(0, 1), "obstacles": slice(1, None)}
    return {
        (who, unit): np.maximum(values[:, rows].ravel(), LEAST[unit])
        for who, rows in whose.items()
        for unit, values in moved.items()
    }


def report_split(report: Report, split: str, pushes: int, device: str) -> bool:
    """Measure one split; returns whether the engines agree."""
    tasks = load_tasks(split, pushes)
    found = push(tasks, device)
    expected, made = (displacements(poses, tasks.object_poses) for poses in (found.expected, found.made))
    report.head(f"{split}: MuJoCo / Warp", *(f"{q:.0%}" for q in QUANTILES), "p")
    agree = found.unstable == 0
    for key, values in expected.items():
        p = float(ks_2samp(values, made[key]).pvalue)
        agree = agree and p >= LEVEL
        pairs = zip(np.quantile(values, QUANTILES), np.quantile(made[key], QUANTILES), strict=True)
        cells = [f"{ours:.3f} / {theirs:.3f}" for ours, theirs in pairs]
        report.row(f"{key[0]} [{key[1]}]", *cells, f"{p:.2f}")
    steps = np.quantile(found.one_step_m, (0.5, 0.95, 0.99))
    ends = np.quantile(distances_m(found.expected, found.made), (0.5, 0.9, 0.99))
    report.say(
        "",
        "Largest distance of an object's positions in the two engines after one control step from the same state: "
        f"median {steps[0]:.1e} m, 95% {steps[1]:.1e} m, 99% {steps[2]:.1e} m. "
        f"Distance of an object's final positions: median {ends[0]:.1e} m, 90% {ends[1]:.1e} m, 99% {ends[2]:.1e} m. "
        f"Contacts or near pairs in use: {found.contacts:.0f} a world; rows of constraints: {found.constraints}; "
        f"invalid: {found.unstable}.",
    )
    return agree


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table for each split; exit code 1 if the engines do not agree."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pushes", type=int, default=128)
    parser.add_argument("--splits", default="sparse-test,moderate-test,dense-test")
    parser.add_argument("--device", default="cpu")
    add_record_option(parser)
    options = parser.parse_args(arguments)
    report = Report("gpu_parity")
    report.say(
        f"{options.pushes} pushes of the target, each in a scene of its own, with MuJoCo Warp on the device "
        f"`{options.device}`: displacements at the end, and the p-value of a Kolmogorov-Smirnov test."
    )
    agree = [report_split(report, split, options.pushes, options.device) for split in options.splits.split(",")]
    report.keep(options.record)
    return int(not all(agree))


if __name__ == "__main__":
    sys.exit(main())
