"""Complete scenes (settled, certified, 16 goal pairs, stored) per second on all cores, for each track.

Workers are started and have read their assets before the clock starts:

    python benchmarks/scene_rate.py [--scenes 16] [--workers 0] [--library procedural] [--tracks sparse,moderate,dense]
"""

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil

from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.named_libraries import open_library
from clutter6d.scenegen.generation import generate_scenes, open_for_generation
from clutter6d.scenegen.scene_set import SceneSet
from clutter6d.scenegen.track import TRACKS, find_track

WANTED_MODERATE_RATE = 1.0


@dataclass(frozen=True, kw_only=True, slots=True)
class Rate:
    """What was measured of one track.

    Attributes:
        scenes_per_s: From the first scene that every worker has finished to the last.
        processor_s: Processor time of a scene, which a busy machine stretches less.
        failures: Failed draws and states of a scene, by reason.
    """

    scenes_per_s: float
    processor_s: float
    failures: dict[str, float]


def measure(library: AssetLibrary, track: str, scenes: int, workers: int) -> Rate:
    """Make scenes on several workers."""
    with tempfile.TemporaryDirectory() as folder:
        scene_set = open_for_generation(library, find_track(track), 0, Path(folder) / "scenes")
        finished: list[tuple[float, float]] = []
        for _ in generate_scenes(library, find_track(track), 0, scene_set, range(scenes + workers), workers=workers):
            finished.append((time.perf_counter(), processor_seconds()))
        failures = SceneSet.open(scene_set.path).failures()
        (start, used_before), (end, used) = finished[workers - 1], finished[-1]
        return Rate(
            scenes_per_s=scenes / (end - start),
            processor_s=(used - used_before) / scenes,
            failures={reason: count / (scenes + workers) for reason, count in failures.most_common()},
        )


def processor_seconds() -> float:
    """Of this process and its workers."""
    me = psutil.Process()
    times = [process.cpu_times() for process in (me, *me.children(recursive=True))]
    return sum(each.user + each.system for each in times)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; exit code 1 if moderate scenes are made slower than wanted."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=16)
    parser.add_argument("--workers", type=int, default=0)
    parser.add_argument("--library", default="procedural")
    parser.add_argument("--tracks", default=",".join(TRACKS))
    options = parser.parse_args(arguments)
    workers = options.workers or len(os.sched_getaffinity(0))
    library = open_library(options.library, workers=workers)
    print(f"{options.scenes} scenes of each track on {workers} workers, library '{options.library}'")
    print(f"{'track':<10}{'scenes/s':>10}{'s/scene':>10}{'processor s':>13}   failed draws and states a scene")
    rates: dict[str, Rate] = {}
    for track in options.tracks.split(","):
        rates[track] = rate = measure(library, track, options.scenes, workers)
        failed = ", ".join(f"{reason} {count:.1f}" for reason, count in rate.failures.items())
        speed = f"{rate.scenes_per_s:>10.2f}{1 / rate.scenes_per_s:>10.2f}{rate.processor_s:>13.2f}"
        print(f"{track:<10}{speed}   {failed}", flush=True)
    return 0 if all(rates[name].scenes_per_s >= WANTED_MODERATE_RATE for name in rates if name == "moderate") else 1


if __name__ == "__main__":
    sys.exit(main())
