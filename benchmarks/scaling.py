"""What a control step of the vector environment costs, by the number of objects and by the number of environments.

Objects: 4, 8 and 12 are frozen scenes; 16 and 24 are scenes of tracks of our own, from the frozen objects, over the
whole table. Environments: frozen sparse scenes, each environment its own. Every size runs in a process of its own, so
that its memory can be told; models are compiled there before the clock starts.

    python benchmarks/scaling.py [--objects 4,8,12,16,24] [--envs 1,2,4,8,...,1024] [--seconds 2] [--record]
"""

import argparse
import multiprocessing
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
from bars import bar
from environment_runs import BareRun, EnvironmentRun
from generated_scenes import FirstScenes, crowded_scenes
from machine import cores, peak_memory_mb, seconds_of
from tables import Report, add_record_option

from clutter6d.dataset.scenes import SceneCollection, load_split
from clutter6d.physics import CONTROL_STEP_S

FROZEN = {4: "sparse-train", 8: "moderate-test", 12: "dense-test"}
OBJECTS_ENVS = 64
ENVS = tuple(2**power for power in range(11))
ENVIRONMENT_STEPS = 2048
MIN_STEPS, MAX_STEPS = 5, 40


@dataclass(frozen=True, kw_only=True, slots=True)
class Size:
    """How many of what.

    Attributes:
        objects: In each scene.
        envs: Side by side.
        scenes: Different ones; environments go through them again.
    """

    objects: int
    envs: int
    scenes: int


@dataclass(frozen=True, kw_only=True, slots=True)
class Cost:
    """What was measured of one size.

    Attributes:
        bare: Control steps per second of ``mujoco.batch`` alone, all environments together.
        full: The same through the environment.
        parts: Convex parts of an object, on average.
        start_s: Seconds to compile all scenes and start.
        memory_mb: The most memory the process held, less what it held before the environment.
    """

    bare: float
    full: float
    parts: float
    start_s: float
    memory_mb: float


def scenes_of(size: Size) -> SceneCollection:
    """The scenes of a size."""
    if size.objects in FROZEN:
        return FirstScenes(load_split(FROZEN[size.objects]), size.scenes)
    return crowded_scenes(size.objects, size.scenes)


def measure(size: Size, seconds: float, threads: int) -> Cost:
    """Time one size, in this process; the fastest of at least three rounds each, in turns."""
    scenes = scenes_of(size)
    for scene in scenes.scenes:
        scenes.assets_of(scene)
    before = peak_memory_mb()
    start = time.perf_counter()
    run_steps = min(MAX_STEPS, max(MIN_STEPS, ENVIRONMENT_STEPS // size.envs))
    full = EnvironmentRun(scenes, size.envs, run_steps, threads)
    full.reset()
    start_s = time.perf_counter() - start
    full.record()
    memory_mb = peak_memory_mb() - before
    bare = BareRun(full, threads)
    times: list[tuple[float, float]] = []
    while len(times) < 3 or sum(map(sum, times)) < seconds:
        times.append((_timed(bare.reset, bare.run), _timed(full.reset, full.run)))
    bare_s, full_s = (min(column) for column in zip(*times, strict=True))
    steps = size.envs * run_steps
    parts = float(np.mean([len(asset.parts) for model in full.batch.scenes for asset in model.assets]))
    return Cost(bare=steps / bare_s, full=steps / full_s, parts=parts, start_s=start_s, memory_mb=memory_mb)


def _timed(prepare: Callable[[], None], run: Callable[[], None]) -> float:
    prepare()
    return seconds_of(run)


def measure_apart(size: Size, seconds: float, threads: int) -> Cost:
    """Time one size in a fresh process."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(measure, size, seconds, threads).result()


def report_sizes(report: Report, sizes: Sequence[Size], label: str, seconds: float, threads: int) -> None:
    """One table: a row for each size."""
    report.head(
        label,
        "parts",
        "bare",
        "environment",
        "ratio",
        "s/s/core",
        "start s",
        "MB",
    )
    for size in bar(sizes, label):
        cost = measure_apart(size, seconds, threads)
        per_core = cost.full * CONTROL_STEP_S / threads
        cells = (f"{cost.parts:.1f}", f"{cost.bare:,.0f}", f"{cost.full:,.0f}", f"{cost.full / cost.bare:.2f}")
        first = size.objects if label == "objects" else size.envs
        report.row(f"{first:,}", *cells, f"{per_core:,.1f}", f"{cost.start_s:.1f}", f"{cost.memory_mb:,.0f}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--objects", default=",".join(map(str, (*FROZEN, 16, 24))))
    parser.add_argument("--envs", default=",".join(map(str, ENVS)))
    parser.add_argument("--scenes", type=int, default=16, help="different scenes of each number of objects")
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--threads", type=int, default=0)
    add_record_option(parser)
    options = parser.parse_args(arguments)
    threads = options.threads or cores()
    report = Report("scaling")
    report.say(
        f"{threads} threads; control steps of {CONTROL_STEP_S} s per second, all environments together, fastest round; "
        f"by objects with {OBJECTS_ENVS} environments on {options.scenes} scenes; by environments with 4 objects, "
        "each environment a scene of its own. Bare is `mujoco.batch` alone, s/s/core the environment's simulated "
        "seconds per second and core; parts are convex parts an object."
    )
    objects = [int(text) for text in options.objects.split(",") if text]
    sizes = [Size(objects=count, envs=OBJECTS_ENVS, scenes=options.scenes) for count in objects]
    report_sizes(report, sizes, "objects", options.seconds, threads)
    envs = [int(text) for text in options.envs.split(",") if text]
    sizes = [Size(objects=4, envs=count, scenes=count) for count in envs]
    report_sizes(report, sizes, "environments", options.seconds, threads)
    report.keep(options.record)
    return 0


if __name__ == "__main__":
    sys.exit(main())
