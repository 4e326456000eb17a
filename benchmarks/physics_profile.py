"""What each physics setting costs, and what it does to outcomes: the benchmark's own against one change at a time.

Every setting plays the same scripted pushes in the same frozen scenes. Its speed is compared with the benchmark's
setting in turns, and so is what comes of it: whether the stored states still hold for a second, and where the objects
lie after the push.

    python benchmarks/physics_profile.py [--track sparse] [--tasks 32] [--rounds 2] [--only solver] [--record]
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from bars import bar
from frozen_tasks import SPLITS, Tasks, load_tasks
from machine import processor_seconds_of
from mujoco.batch import Batch
from physics_variants import REFERENCE, VARIANTS, Variant, unpadded
from pushes import PUSH_STEPS, push_targets
from step_stages import Stages, time_stages
from tables import Report, add_record_option

from clutter6d.physics import CONTROL_STEP_S
from clutter6d.scenegen.certificate import CertificateLimits
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.scene_model import ARM_DOF, joint_state
from clutter6d.sim.settle import Drift, measure_drift

LIMITS = CertificateLimits()
MOVED_M = 0.01
HOLD_LOOKS = 4


class Physics:
    """The tasks under one setting, in one batch."""

    def __init__(self, tasks: Tasks, variant: Variant, threads: int) -> None:
        self._variant, self._start = variant, tasks.object_poses
        models = variant.models(tasks)
        self._batch = Batch(models[0], len(models), threads, variant.is_persistent)
        self._batch.set_models(models)
        self._qpos, self._qvel, self._ctrl = (self._batch.bind(name) for name in ("qpos", "qvel", "ctrl"))

    def reset(self, offset_m: float = 0.0) -> None:
        """All objects as stored, at rest, the arm at home; the target moved by an offset."""
        poses = self._start.copy()
        poses[:, 0, 0] += offset_m
        self._batch.reset(stage=0)
        self._batch.state[:] = 0
        self._qpos[:] = joint_state(poses)
        self._ctrl[:] = HOME_QPOS

    def advance(self, seconds: float) -> None:
        """Simulate."""
        self._batch.step(nstep=round(seconds / self._variant.physics_step_s))

    def push(self, targets: np.ndarray) -> None:
        """Play joint targets, one row a control step."""
        for row in targets:
            self._ctrl[:] = row
            self.advance(CONTROL_STEP_S)

    @property
    def object_poses(self) -> np.ndarray:
        """Present poses of all objects."""
        return self._qpos[:, ARM_DOF:].reshape(self._start.shape).copy()

    def hold(self) -> Drift:
        """How far objects get from their stored poses within a second, at most at four looks."""
        self.reset()
        looks: list[Drift] = []
        for _ in range(HOLD_LOOKS):
            self.advance(1 / HOLD_LOOKS)
            looks.append(measure_drift(self._start, self.object_poses))
        return Drift(
            distance_m=np.max([look.distance_m for look in looks], axis=0),
            angle_rad=np.max([look.angle_rad for look in looks], axis=0),
        )

    def outcome(self, targets: np.ndarray) -> np.ndarray:
        """Poses of all objects after the pushes."""
        self.reset(self._variant.start_offset_m)
        self.push(targets)
        return self.object_poses

    def seconds(self, targets: np.ndarray) -> float:
        """Processor time of the pushes, which other work on the machine stretches least."""
        self.reset()
        return processor_seconds_of(lambda: self.push(targets))


@dataclass(frozen=True, kw_only=True, slots=True)
class Effect:
    """What one setting does.

    Attributes:
        speed: Times as fast as the benchmark's setting; median of rounds in turns.
        states_held: Share of stored states that hold for a second within the certificate's limits.
        drift_m: Largest drift of any object in that second.
        identical: Share of objects whose final pose is the same to the bit.
        within: Share of the objects that were moved that end within the certificate's limits of the reference.
        difference_m: Median and 90th percentile of how far apart the moved objects end.
        displacement_m: Mean distance by which the targets were moved.
    """

    speed: float
    states_held: float
    drift_m: float
    identical: float
    within: float
    difference_m: tuple[float, float]
    displacement_m: float


def is_within(drift: Drift) -> np.ndarray:
    """Which objects kept the certificate's limits."""
    return (drift.distance_m <= LIMITS.drift_m) & (drift.angle_rad <= LIMITS.drift_rad)


def compare(
    reference: Physics, expected: np.ndarray, other: Physics, targets: np.ndarray, start: np.ndarray, rounds: int
) -> Effect:
    """Measure one setting against the benchmark's, whose outcome is known."""
    held, found = other.hold(), other.outcome(targets)
    was_moved = measure_drift(start, expected).distance_m > MOVED_M
    apart = measure_drift(expected, found)
    middle, most = np.quantile(apart.distance_m[was_moved], (0.5, 0.9))
    times = [(reference.seconds(targets), other.seconds(targets)) for _ in range(rounds)]
    return Effect(
        speed=float(np.median([ours / its for ours, its in times])),
        states_held=float(is_within(held).all(axis=1).mean()),
        drift_m=float(held.distance_m.max()),
        identical=float((expected == found).all(axis=-1).mean()),
        within=float(is_within(apart)[was_moved].mean()),
        difference_m=(float(middle), float(most)),
        displacement_m=float(measure_drift(start, found).distance_m[:, 0].mean()),
    )


def padding_ratio(tasks: Tasks, targets: np.ndarray, threads: int, rounds: int) -> float:
    """Speed without the padding that gives all scenes of a track one layout, on copies of a few scenes each."""
    ratios: list[float] = []
    for index in range(min(8, len(tasks))):
        alone = Tasks(models=[tasks.models[index]] * len(tasks), pairs=[tasks.pairs[index]] * len(tasks))
        pushes = np.repeat(targets[:, index : index + 1], len(tasks), axis=1)
        padded = Physics(alone, REFERENCE, threads)
        model = unpadded(alone.head(1))[0]
        bare = Physics(alone, Variant(name="", models=lambda some, model=model: [model] * len(some)), threads)
        ratios += [padded.seconds(pushes) / bare.seconds(pushes) for _ in range(rounds)]
    return float(np.median(ratios))


def report_stages(report: Report, stages: Stages) -> None:
    """Print where a step's time goes."""
    report.head("stage of a physics step", "µs", "share")
    total = sum(stages.stage_us.values())
    for name, spent in stages.stage_us.items():
        report.row(name, f"{spent:.1f}", f"{spent / total:.0%}")
    report.say(
        "",
        f"A whole step takes {stages.step_us:.0f} µs of one core, with {stages.contacts:.0f} contact points and "
        f"{stages.rows:.0f} constraint rows on average.",
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--track", choices=SPLITS, default="sparse")
    parser.add_argument("--tasks", type=int, default=32)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--only", default="", help="settings whose name contains this")
    add_record_option(parser)
    options = parser.parse_args(arguments)
    report = Report(f"physics_profile_{options.track}")
    tasks = load_tasks(SPLITS[options.track], options.tasks)
    targets = push_targets(tasks)
    reference = Physics(tasks, REFERENCE, options.threads)
    seconds = min(reference.seconds(targets) for _ in range(options.rounds))
    simulated = len(tasks) * PUSH_STEPS * CONTROL_STEP_S
    report.say(
        f"{len(tasks)} scenes of {SPLITS[options.track]}, one push each; the benchmark's setting simulates "
        f"{simulated / seconds:,.0f} seconds per processor second. Each setting in turns with it, median of "
        f"{options.rounds} rounds, processor time."
    )
    report.head(
        "setting",
        "speed",
        "held",
        "drift mm",
        "same bits",
        "within",
        "median mm",
        "p90 mm",
        "moved mm",
    )
    expected = reference.outcome(targets)
    for variant in bar([item for item in VARIANTS if options.only in item.name], "settings"):
        effect = compare(
            reference,
            expected,
            Physics(tasks, variant, options.threads),
            targets,
            tasks.object_poses,
            options.rounds,
        )
        apart = (f"{1000 * value:.2f}" for value in effect.difference_m)
        shares = (f"{effect.identical:.0%}", f"{effect.within:.0%}")
        held = (f"{effect.states_held:.0%}", f"{1000 * effect.drift_m:.2f}")
        report.row(variant.name, f"{effect.speed:.2f}", *held, *shares, *apart, f"{1000 * effect.displacement_m:.0f}")
    if not options.only:
        report_stages(report, time_stages(tasks, targets))
        ratio = padding_ratio(tasks, targets, options.threads, options.rounds)
        report.say("", f"Without the padding to one layout the same scenes run {ratio:.2f} times as fast.")
    report.keep(options.record)
    return 0


if __name__ == "__main__":
    sys.exit(main())
