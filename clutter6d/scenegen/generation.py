"""Generating many scenes at once into a scene set, resumable, on any number of workers."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from clutter6d.assets.library import AssetLibrary
from clutter6d.errors import Clutter6DError, GenerationError
from clutter6d.executor import LOCAL, Executor, TaskResult, map_tasks
from clutter6d.scenegen.certificate import GENERATOR_VERSION
from clutter6d.scenegen.generator import SceneGenerator, scene_id
from clutter6d.scenegen.scene_set import GenerationRecord, SceneSet, SceneSetFile, assets_sha256
from clutter6d.scenegen.track import Track


@dataclass(frozen=True, kw_only=True, slots=True)
class SceneTask:
    """Makes one scene by its index and stores it; picklable, and cheap to call again in the same process.

    Attributes:
        library: Folder of the asset library.
        track: What a scene is made of.
        seed: The user's seed.
        out: Folder of the scene set.
    """

    library: Path
    track: Track
    seed: int
    out: Path

    def __call__(self, index: int) -> str:
        """Generate scene ``index``, store it, and return its id."""
        start = time.monotonic()
        scene_generator, scene_set = _open(self)
        made = scene_generator.generate(index)
        record = GenerationRecord(failures=dict(made.failures), seconds=time.monotonic() - start)
        scene_set.add(made.scene, scene_generator.assets_of(made.scene), record)
        return made.scene.scene_id


_opened: dict[SceneTask, tuple[SceneGenerator, SceneSet]] = {}


def _open(task: SceneTask) -> tuple[SceneGenerator, SceneSet]:
    """The generator and the scene set of a task, kept between calls so that a worker reads and stores an asset once."""
    if task not in _opened:
        _opened.clear()
        generator = SceneGenerator(AssetLibrary.open(task.library), task.track, task.seed)
        _opened[task] = generator, SceneSet.open(task.out)
    return _opened[task]


def open_for_generation(library: AssetLibrary, track: Track, seed: int, out: Path) -> SceneSet:
    """Start or continue the scene set of a track, a seed and a library."""
    header = SceneSetFile(
        track=track.name,
        seed=seed,
        library_sha256=assets_sha256(library.index()["content_hash"]),
        generator_version=GENERATOR_VERSION,
    )
    SceneGenerator(library, track, seed)  # refuses a library that is too small before anything is written
    return SceneSet.create(out, header)


def generate_scenes(
    library: AssetLibrary,
    track: Track,
    seed: int,
    scene_set: SceneSet,
    indices: range,
    *,
    workers: int = 1,
    executor: Executor = LOCAL,
) -> Iterator[str]:
    """Generate the scenes that a set still lacks; yields the id of each as it is stored.

    The workers read the library's folder and write into the set's, so on a cluster both are on a shared file system.

    Raises:
        GenerationError: A scene could not be made; the others are kept.
    """
    _opened.clear()  # the folders may have changed since an earlier run of this process
    task = SceneTask(library=library.path.resolve(), track=track, seed=seed, out=scene_set.path.resolve())
    missing = [index for index in indices if not has_scene(scene_set, track, seed, index)]
    for result in map_tasks(task, missing, workers=workers, executor=executor):
        yield _unwrap(result)


def has_scene(scene_set: SceneSet, track: Track, seed: int, index: int) -> bool:
    """Whether a scene is already stored."""
    return (scene_set.scene_folder(scene_id(track.name, seed, index)) / "scene.json").is_file()


def _unwrap(result: TaskResult[int, str]) -> str:
    if result.value is not None:
        return result.value
    failure = result.failure
    if failure is not None and isinstance(failure.error, Clutter6DError):
        raise failure.error
    raise GenerationError(f"scene {result.index}: worker failed ({failure.kind}: {failure.detail})" if failure else "")
