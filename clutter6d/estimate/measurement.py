"""Unit costs, measured now and here on a few assets and scenes."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from clutter6d.assets.asset_file import PackedAsset, pack_asset
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.processing import ProcessingSettings, process_object
from clutter6d.assets.sources.base import AssetSource, SourceObject
from clutter6d.errors import Clutter6DError, InvalidValueError
from clutter6d.estimate.metered import Metered, Reading
from clutter6d.estimate.plan import UnitCost
from clutter6d.executor import TaskLimits, TaskResult, map_tasks
from clutter6d.scenegen.generation import SceneTask, open_for_generation
from clutter6d.scenegen.track import Track

Item = TypeVar("Item")
OnDone = Callable[[], object]
_ASSET_LIMITS = TaskLimits(seconds=60.0, memory_bytes=4 << 30)


@dataclass(frozen=True, slots=True)
class _MakeAsset:
    source: AssetSource
    settings: ProcessingSettings

    def __call__(self, item: SourceObject) -> PackedAsset:
        return pack_asset(process_object(self.source, item, self.settings))


def measure_assets(source: AssetSource, samples: int, on_done: OnDone = lambda: None) -> UnitCost:
    """Process a few objects, spread over the source; the first one only warms the worker.

    Raises:
        InvalidValueError: The source has no object that becomes an asset.
    """
    chosen = spread(source.objects(), samples + 1)
    settings, sizes, storing = ProcessingSettings(), list[int](), list[float]()
    costs, detail = _Costs(), "it has none"
    with TemporaryDirectory() as folder:
        library = AssetLibrary.create(Path(folder) / "library")
        for result in map_tasks(Metered(_MakeAsset(source, settings)), chosen, limits=_ASSET_LIMITS):
            reading = costs.add(result)
            if reading is not None:
                before, start = folder_bytes(library.path), time.perf_counter()
                library.add_packed(reading.value)
                storing.append(time.perf_counter() - start)
                sizes.append(folder_bytes(library.path) - before)
            elif result.failure is not None:
                detail = result.failure.detail
            on_done()
    if not sizes:
        raise InvalidValueError(f"none of {len(chosen)} sampled objects of '{source.name}' became an asset ({detail})")
    return costs.unit_cost(bytes_each=_mean(sizes), share=len(sizes) / len(chosen), serial_s=_mean(storing))


def measure_scenes(library: AssetLibrary, track: Track, seed: int, samples: int, on_done: OnDone) -> UnitCost:
    """Generate the first few scenes of a seed; the first one only warms the worker.

    Raises:
        GenerationError: A scene could not be made.
        InvalidValueError: The library is too small for the track.
    """
    costs = _Costs()
    with TemporaryDirectory() as folder:
        scene_set = open_for_generation(library, track, seed, Path(folder) / "scenes")
        task = SceneTask(library=library.path.resolve(), track=track, seed=seed, out=scene_set.path)
        for result in map_tasks(Metered(task), range(samples + 1), limits=TaskLimits()):
            if costs.add(result) is None and result.failure is not None:
                raise result.failure.error or Clutter6DError(f"scene {result.index}: {result.failure.detail}")
            on_done()
        return costs.unit_cost(bytes_each=folder_bytes(scene_set.path / "scenes") / (samples + 1))


class _Costs:
    """Collects readings of one worker."""

    def __init__(self) -> None:
        self._seconds: list[float] = []
        self._start_s: float = 0.0

    def add(self, result: TaskResult[Any, Reading]) -> Reading | None:
        """Note an item; its reading if it gave a result. One that failed counts with the time it took on the wall."""
        reading = result.value
        self._seconds.append(result.seconds if reading is None else reading.seconds)
        if reading is not None and result.index == 0:
            self._start_s = reading.before_s
        return reading

    def unit_cost(self, *, bytes_each: float, share: float = 1.0, serial_s: float = 0.0) -> UnitCost:
        first, *warm = self._seconds
        seconds = tuple(warm) or (first,)
        start_s = self._start_s + max(first - _mean(seconds), 0.0)
        return UnitCost(seconds=seconds, bytes_each=bytes_each, share=share, start_s=start_s, serial_s=serial_s)


def spread(items: Sequence[Item], count: int) -> list[Item]:
    """So many of the items, at even distances; all if there are not more."""
    if count >= len(items):
        return list(items)
    return [items[round(index * (len(items) - 1) / max(count - 1, 1))] for index in range(count)]


def folder_bytes(folder: Path) -> int:
    """Bytes of all files below a folder."""
    return sum(path.stat().st_size for path in _files(folder))


def _files(folder: Path) -> Iterator[Path]:
    return (path for path in folder.rglob("*") if path.is_file())


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)
