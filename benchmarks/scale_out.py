"""Assets and scenes on Ray workers: how much faster two are than one, whether the bytes are the same, what it costs.

Ray is started before the clock; starting the workers is on the clock. Processor time is that of this process (which
stores assets), of the worker processes, and of everything of Ray's own:

    python benchmarks/scale_out.py [--items 200] [--workers 2] [--source procedural] [--track sparse] [--rounds 1]

With more rounds, one worker and two take turns, and the fastest of each counts, so that other work disturbs less.
"""

import argparse
import hashlib
import json
import os
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil

from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.named_libraries import open_library
from clutter6d.assets.processing import ProcessingSettings
from clutter6d.assets.run import RunSettings, run, settings_as_stored
from clutter6d.assets.sources.registry import make_source
from clutter6d.executor import Executor, map_tasks, parse_executor
from clutter6d.scenegen.generation import generate_scenes, open_for_generation
from clutter6d.scenegen.track import find_track

WANTED_SPEED_UP = 1.7
PARTS = ("this process", "workers", "Ray itself")


@dataclass(frozen=True, kw_only=True, slots=True)
class Run:
    """One measured run: seconds on the wall, processor seconds by part, and a hash of all it wrote."""

    wall_s: float
    processor_s: Counter[str]
    digest: str


class Meter:
    """Samples the processor time of this process and all below it, by part."""

    def __init__(self) -> None:
        self._seconds: dict[int, tuple[str, float]] = {}
        self._stop = threading.Event()

    def _sample(self) -> None:
        me = psutil.Process()
        for process in (me, *me.children(recursive=True)):
            try:
                times, command = process.cpu_times(), " ".join(process.cmdline())
            except psutil.Error:
                continue
            part = PARTS[0] if process == me else PARTS[1] if "multiprocessing.spawn" in command else PARTS[2]
            known, _ = self._seconds.get(process.pid, (part, 0.0))  # one that is ending has no command any more
            self._seconds[process.pid] = (known, times.user + times.system)

    def total(self) -> Counter[str]:
        """Processor seconds so far, by part."""
        self._sample()
        found: Counter[str] = Counter()
        for part, seconds in self._seconds.values():
            found[part] += seconds
        return found

    @contextmanager
    def running(self) -> Iterator["Meter"]:
        """Sample every second, since workers that end take their clocks with them."""

        def watch() -> None:
            while not self._stop.wait(1.0):
                self._sample()

        thread = threading.Thread(target=watch, daemon=True)
        thread.start()
        try:
            yield self
        finally:
            self._stop.set()
            thread.join()


def make_assets(name: str) -> Callable[[int, int, Executor, Path], None]:
    """The first objects of a source."""

    def make(items: int, workers: int, executor: Executor, folder: Path) -> None:
        source, settings = make_source(name, limit=items), ProcessingSettings()
        library = AssetLibrary.create(folder, settings_as_stored(settings))
        chosen = source.objects()[:items]
        for _ in run(source, chosen, library, settings, RunSettings(workers=workers, executor=executor)):
            pass

    return make


def make_scenes(track: str) -> Callable[[int, int, Executor, Path], None]:
    """The first scenes of seed 0 of a track, from the built-in objects."""
    library, chosen = open_library("procedural"), find_track(track)

    def make(items: int, workers: int, executor: Executor, folder: Path) -> None:
        scene_set = open_for_generation(library, chosen, 0, folder)
        for _ in generate_scenes(library, chosen, 0, scene_set, range(items), workers=workers, executor=executor):
            pass

    return make


def measure(work: Callable[[int, int, Executor, Path], None], items: int, workers: int, executor: Executor) -> Run:
    """Do the work once in a fresh folder."""
    with tempfile.TemporaryDirectory() as folder, Meter().running() as meter:
        out = Path(folder) / "out"
        before, start = meter.total(), time.perf_counter()
        work(items, workers, executor, out)
        wall_s = time.perf_counter() - start
        return Run(wall_s=wall_s, processor_s=meter.total() - before, digest=digest_of(out))


def digest_of(folder: Path) -> str:
    """A hash of every file and its name; what is said in them of times aside."""
    digest = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        content = path.read_bytes()
        if path.suffix == ".json":
            content = json.dumps(without_times(json.loads(content)), sort_keys=True).encode()
        digest.update(f"{path.relative_to(folder)} {hashlib.sha256(content).hexdigest()}\n".encode())
    return digest.hexdigest()


def without_times(value: object) -> object:
    """A JSON value without any entry named ``seconds``."""
    if isinstance(value, dict):
        return {key: without_times(item) for key, item in value.items() if key != "seconds"}
    return [without_times(item) for item in value] if isinstance(value, list) else value


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; exit code 1 if two workers are not enough faster, or write other bytes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--items", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--source", default="procedural")
    parser.add_argument("--track", default="sparse")
    parser.add_argument("--executor", default="ray")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--only", choices=("assets", "scenes"))
    options = parser.parse_args(arguments)
    executor = parse_executor(options.executor)
    works = {"assets": make_assets(options.source), f"{options.track} scenes": make_scenes(options.track)}
    works = {name: work for name, work in works.items() if name.endswith(options.only or "")}
    start = time.perf_counter()
    list(map_tasks(abs, [-1], workers=1, executor=executor))
    print(f"{options.executor} started in {time.perf_counter() - start:.1f} s; load {os.getloadavg()[0]:.1f}")
    print(f"{options.items} of each{'':<9}{'wall s':>8}  processor s of {', '.join(PARTS)}")
    is_good = True
    for name, work in works.items():
        runs: dict[int, list[Run]] = {1: [], options.workers: []}
        for workers in [*runs] * options.rounds:
            found = measure(work, options.items, workers, executor)
            runs[workers].append(found)
            parts = "  ".join(f"{found.processor_s[part]:8.1f}" for part in PARTS)
            print(f"{name:<14} on {workers}{found.wall_s:>8.1f}  {parts}", flush=True)
        fastest = {workers: min(found.wall_s for found in several) for workers, several in runs.items()}
        speed_up = fastest[1] / fastest[options.workers]
        is_same = len({found.digest for several in runs.values() for found in several}) == 1
        print(f"{name}: speed-up {speed_up:.2f}; bytes {'identical' if is_same else 'DIFFER'}", flush=True)
        is_good &= is_same and (speed_up >= WANTED_SPEED_UP or options.workers < 2)
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
