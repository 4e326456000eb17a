"""What the options of an environment cost: varied physics, noise, cameras.

Means of a few calls, beside a plain observation and a plain control step of as many environments on as many threads.

    python benchmarks/option_costs.py [--envs 64] [--calls 10] [--track sparse] [--record]
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from frozen_tasks import SPLITS, Tasks, load_tasks
from machine import seconds_of
from tables import Report, add_record_option

from clutter6d.envs.cameras import DEFAULT_CAMERAS, CameraRig
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.noise import DISTILLATION_NOISE, NoiseConfig, sensitivity_noise
from clutter6d.envs.randomisation import MODEST_RANDOMISATION, draw_physics, vary_physics
from clutter6d.envs.slots import ClutterSlots
from clutter6d.render.backend import choose_backend
from clutter6d.seeding import generator
from clutter6d.sim.scene_model import SceneModel, joint_state

DRAWN_SCENES = 8
"""Scenes that the cameras look at; an environment costs the same each."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--envs", type=int, default=64)
    parser.add_argument("--calls", type=int, default=10)
    parser.add_argument("--track", default="sparse", choices=SPLITS)
    add_record_option(parser)
    options = parser.parse_args(arguments)
    tasks, report = load_tasks(SPLITS[options.track], options.envs), Report("option_costs")
    report.say(f"{options.envs} environments, {options.track} scenes; milliseconds per environment.")
    report.head("what", "ms")
    measure_slots(report, tasks, options.calls)
    measure_variation(report, tasks)
    for backend in dict.fromkeys((choose_backend(), "raycast")):
        measure_cameras(report, tasks.head(DRAWN_SCENES), backend, options.calls)
    report.keep(options.record)


def mean_ms(run: Callable[[], object], calls: int, per_call: int) -> str:
    """Milliseconds of one of the things that a call does, after one call to warm up."""
    run()
    return f"{1e3 * seconds_of(lambda: [run() for _ in range(calls)]) / calls / per_call:.3f}"


def measure_slots(report: Report, tasks: Tasks, calls: int) -> None:
    """A control step, an observation, and observations with noise."""
    plain, every = make_slots(tasks, NoiseConfig()), np.arange(len(tasks))
    zero = np.zeros((len(tasks), 7), dtype=np.float32)
    report.row("a control step of 0.1 s", mean_ms(lambda: plain.step(every, zero), calls, len(tasks)))
    report.row("an observation", mean_ms(plain.observe, calls, len(tasks)))
    noises = {"with wrong inputs": sensitivity_noise("all", 0.05), "with the distillation's noise": DISTILLATION_NOISE}
    for name, noise in noises.items():
        report.row(f"an observation {name}", mean_ms(make_slots(tasks, noise).observe, calls, len(tasks)))


def make_slots(tasks: Tasks, noise: NoiseConfig) -> ClutterSlots:
    """Environments at the start of their tasks."""
    slots = ClutterSlots(tasks.models, EnvConfig(noise=noise))
    rngs = [generator(0, "noise", slot) for slot in range(len(tasks))]
    slots.load(np.arange(len(tasks)), tasks.models, tasks.pairs, noise_rngs=rngs)
    return slots


def measure_variation(report: Report, tasks: Tasks) -> None:
    """An episode's own masses, frictions and table height, at its reset."""

    def vary() -> list[SceneModel]:
        draws = [draw_physics(MODEST_RANDOMISATION, generator(0, n), tasks.object_count) for n in range(len(tasks))]
        return [vary_physics(model, draw) for model, draw in zip(tasks.models, draws, strict=True)]

    report.row("varied physics, at a reset", mean_ms(vary, 3, len(tasks)))


def measure_cameras(report: Report, tasks: Tasks, backend: str, calls: int) -> None:
    """Three cameras, by kind of picture."""
    qpos, size = joint_state(tasks.object_poses), f"{DEFAULT_CAMERAS[0].width} x {DEFAULT_CAMERAS[0].height}"
    with CameraRig(backend=backend) as rig:
        first = 1e3 * seconds_of(lambda: rig.observe(tasks.models, qpos)) / len(tasks)
        report.row(f"3 cameras of {size}, {backend}: a scene's first", f"{first:.1f}")
        calls = 1 if backend == "raycast" else calls
        report.row("then each time", mean_ms(lambda: rig.observe(tasks.models, qpos), calls, len(tasks)))
    without_colour = [replace(camera, kinds=("depth", "segmentation")) for camera in DEFAULT_CAMERAS]
    with CameraRig(without_colour, backend=backend) as rig:
        taken = mean_ms(lambda: rig.observe(tasks.models, qpos), calls, len(tasks))
        report.row("depth and segmentation alone", taken)


if __name__ == "__main__":
    main()
