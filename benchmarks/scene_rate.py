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
from pathlib import Path

from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.named_libraries import open_library
from clutter6d.scenegen.generation import generate_scenes, open_for_generation
from clutter6d.scenegen.scene_set import SceneSet
from clutter6d.scenegen.track import TRACKS, find_track

WANTED_MODERATE_RATE = 0.5


def measure(library: AssetLibrary, track: str, scenes: int, workers: int) -> tuple[float, int]:
    """Scenes per second, from the first scene that every worker has finished to the last; and failed draws."""
    with tempfile.TemporaryDirectory() as folder:
        scene_set = open_for_generation(library, find_track(track), 0, Path(folder) / "scenes")
        finished: list[float] = []
        for _ in generate_scenes(library, find_track(track), 0, scene_set, range(scenes + workers), workers=workers):
            finished.append(time.perf_counter())
        failures = SceneSet.open(scene_set.path).failures()
        return scenes / (finished[-1] - finished[workers - 1]), sum(failures.values())


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
    print(f"{'track':<10}{'scenes/s':>10}{'s/scene':>10}{'failed draws':>14}")
    rates: dict[str, float] = {}
    for track in options.tracks.split(","):
        rates[track], failures = measure(library, track, options.scenes, workers)
        print(f"{track:<10}{rates[track]:>10.2f}{1 / rates[track]:>10.2f}{failures:>14}", flush=True)
    return 0 if rates.get("moderate", WANTED_MODERATE_RATE) >= WANTED_MODERATE_RATE else 1


if __name__ == "__main__":
    sys.exit(main())
