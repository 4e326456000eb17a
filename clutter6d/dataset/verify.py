"""Checking a frozen data set: every hash; if asked, every certificate in the simulator and scenes made anew."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float64

from clutter6d.assets.processing import ProcessingSettings, process_object
from clutter6d.assets.sources.registry import make_source
from clutter6d.dataset.dataset import Dataset
from clutter6d.dataset.parquet import MAX_FILE_BYTES
from clutter6d.dataset.split import Split
from clutter6d.errors import Clutter6DError, InvalidFileError, InvalidValueError
from clutter6d.executor import LOCAL, Executor, map_tasks
from clutter6d.scene import Scene
from clutter6d.scene_file import scene_sha256
from clutter6d.scenegen.certificate import CertificateLimits, StateReport, check_at_rest, is_reachable
from clutter6d.scenegen.footprint import footprint_supports, hull_points
from clutter6d.scenegen.generator import SceneGenerator
from clutter6d.scenegen.relations import RelationRules
from clutter6d.scenegen.scene_set import assets_sha256, scenes_sha256
from clutter6d.scenegen.track import find_track
from clutter6d.schema import read_bytes
from clutter6d.seeding import generator
from clutter6d.sim.scene_model import compile_stored_scene
from clutter6d.sim.settle import SettleConfig


@dataclass(frozen=True, kw_only=True, slots=True)
class Finding:
    """What checking one thing gave.

    Attributes:
        what: What was checked.
        problems: What is wrong, one line each; none if all is well.
    """

    what: str
    problems: tuple[str, ...] = ()


def verify_files(dataset: Dataset) -> Iterator[Finding]:
    """Compare every file with the manifest, and look for files that it does not name."""
    for name in sorted(dataset.manifest.files):
        yield Finding(
            what=name, problems=_problems(lambda name=name: dataset.check_file(name, _read(dataset.path / name)))
        )
    known = {*dataset.manifest.files, "manifest.json", "README.md"}
    unknown = sorted(path.name for path in dataset.path.iterdir() if path.name not in known)
    yield Finding(
        what="no other files", problems=tuple(f"{dataset.path / name}: not in the manifest" for name in unknown)
    )


def verify_pools(dataset: Dataset) -> Iterator[Finding]:
    """Check each pool's hash, and that no asset is in two pools."""
    rows = dataset.asset_list
    for name, entry in dataset.manifest.pools.items():
        hashes = rows["content_hash"][rows["pool"] == name]
        is_same = assets_sha256(hashes) == entry.sha256 and len(hashes) == entry.assets
        yield Finding(
            what=f"pool {name}", problems=() if is_same else (f"pool {name}: not the assets that were frozen",)
        )
    twice = rows["content_hash"].duplicated() | rows["name"].duplicated()
    yield Finding(
        what="pools are disjoint", problems=tuple(f"asset {name} is in two pools" for name in rows["name"][twice])
    )


def verify_assets(dataset: Dataset) -> Iterator[Finding]:
    """Read every asset, which checks its content hash, and compare it with the asset list."""
    listed = dataset.asset_list
    for name, content_hash in zip(listed["name"], listed["content_hash"], strict=True):
        yield Finding(what=name, problems=_problems(lambda key=content_hash: dataset.assets.load(key)))


def verify_sources(dataset: Dataset, count: int) -> Iterator[Finding]:
    """Make some assets of each pool from their sources again, and compare their hashes."""
    listed = dataset.asset_list.set_index(["pool", "source_id"])["content_hash"]
    for pool, entry in dataset.manifest.pools.items():
        source = make_source(entry.source, **entry.options)
        items = [item for item in source.objects() if (pool, item.licence.source_id) in listed.index]
        for row in sorted(generator(0, "verify", pool).permutation(len(items))[:count]):
            made = process_object(source, items[row], ProcessingSettings())
            is_same = made.content_hash == listed[pool, items[row].licence.source_id]
            problem = f"pool {pool}: {items[row].key} of source {entry.source} gives another asset here"
            yield Finding(what=made.name, problems=() if is_same else (problem,))


def verify_scenes(split: Split, pool_names: frozenset[str]) -> Iterator[Finding]:
    """Read every scene, compare it with its hash, and check that its assets are of the split's pool."""
    for scene_id in split.scene_ids:
        yield Finding(
            what=scene_id, problems=_problems(lambda scene_id=scene_id: _check_scene(split, scene_id, pool_names))
        )
    is_same = scenes_sha256(split.scene_sha256) == split.sha256
    yield Finding(
        what=split.name, problems=() if is_same else (f"{split.name}: its scenes do not have the split's hash",)
    )


def _check_scene(split: Split, scene_id: str, pool_names: frozenset[str]) -> None:
    scene = split[scene_id]
    if scene.scene_id != scene_id or scene.track != split.entry.track or scene.seed != split.entry.seed:
        raise InvalidFileError(split.path, f"scene {scene_id} is another track's or seed's")
    if scene_sha256(scene) != split.scene_sha256[scene_id]:
        raise InvalidFileError(split.path, f"scene {scene_id} does not have its hash")
    foreign = [item.asset_name for item in scene.objects if item.asset_name not in pool_names]
    if foreign:
        raise InvalidFileError(
            split.path, f"scene {scene_id} uses {foreign[0]}, which is not of pool {split.entry.pool}"
        )
    split.assets_of(scene)


@dataclass(frozen=True, kw_only=True, slots=True)
class SceneCheck:
    """Checks one scene in the simulator; picklable.

    Attributes:
        dataset: Folder of the data set.
        split: Name of the split.
        regenerate: Make the scene from its seed again and compare, instead of simulating its states.
    """

    dataset: Path
    split: str
    regenerate: bool = False

    def __call__(self, scene_id: str) -> Finding:
        """Check one scene by its id."""
        split = _open(self.dataset, self.split)[1]
        check = self._make_again if self.regenerate else check_physics
        return Finding(what=scene_id, problems=_problems(lambda: check(split, scene_id)))

    def _make_again(self, split: Split, scene_id: str) -> None:
        made = _generator_of(self.dataset, self.split).generate(split[scene_id].index).scene
        if scene_sha256(made) != split.scene_sha256[scene_id]:
            problem = f"scene {scene_id}: seed {split.entry.seed} gives another scene here"
            raise InvalidFileError(split.path, f"{problem} (mujoco {mujoco.__version__})")


def verify_in_processes(
    dataset: Dataset,
    split: Split,
    scene_ids: Sequence[str],
    *,
    regenerate: bool,
    workers: int,
    executor: Executor = LOCAL,
) -> Iterator[Finding]:
    """Check scenes in the simulator on several workers, in any order."""
    task = SceneCheck(dataset=dataset.path.resolve(), split=split.name, regenerate=regenerate)
    for result in map_tasks(task, scene_ids, workers=workers, executor=executor):
        failure = result.failure
        yield result.value or Finding(
            what=result.item, problems=(f"{result.item}: {failure.detail if failure else ''}",)
        )


def choose_scenes(split: Split, count: int, seed: int = 0) -> tuple[str, ...]:
    """Some scenes of a split, drawn from a seed."""
    rows = generator(seed, "verify", split.name).permutation(len(split))[:count]
    return tuple(split.scene_ids[row] for row in sorted(rows))


def check_physics(split: Split, scene_id: str) -> None:
    """Check in the simulator everything that a scene's certificate claims, at each start and at each goal.

    Raises:
        InvalidFileError: Something does not hold; names pair and reason.
    """
    scene = split[scene_id]
    starts = np.array([pair.object_poses for pair in scene.goal_pairs])
    goals = starts.copy()
    goals[:, 0] = [pair.goal.as_row() for pair in scene.goal_pairs]
    report = examine(split, scene, np.concatenate([starts, goals]))
    for number, reason in enumerate(report.failures):
        if reason is not None:
            state = "goal" if number >= len(starts) else "start"
            raise InvalidFileError(split.path, f"scene {scene_id} pair {number % len(starts)}, {state}: {reason}")
    limit = find_track(scene.track).min_displacement_m
    if min(pair.planar_displacement_m for pair in scene.goal_pairs) < limit:
        raise InvalidFileError(split.path, f"scene {scene_id}: a goal is less than {limit} m from its start")


def examine(split: Split, scene: Scene, states: Float64[np.ndarray, "state object 7"]) -> StateReport:
    """Measure states of a scene as a certificate does, and whether the hand reaches the target."""
    assets = split.assets_of(scene)
    model = compile_stored_scene(scene, assets)
    hulls = tuple(hull_points(assets[item.asset_hash]) for item in scene.objects)
    limits = CertificateLimits()
    report = check_at_rest(
        model, hulls, states, scene.graph, rules=RelationRules(), limits=limits, config=SettleConfig()
    )
    _, spans = footprint_supports(hulls[0], states[:, 0, 3:])
    reachable = is_reachable(model, states, states[:, 0, 2] + spans[:, 1], limits)
    return report.with_failures("unreachable", ~reachable)


@cache
def _open(folder: Path, split: str) -> tuple[Dataset, Split]:
    """Once a worker, and with it the file of the assets."""
    dataset = Dataset(folder)
    return dataset, dataset.split(split)


@cache
def _generator_of(folder: Path, split: str) -> SceneGenerator:
    dataset, opened = _open(folder, split)
    return SceneGenerator(dataset.pool(opened.entry.pool), find_track(opened.entry.track), opened.entry.seed)


def _read(path: Path) -> bytes:
    return read_bytes(path, what="file of a data set", max_bytes=MAX_FILE_BYTES)


def _problems(check: Callable[[], object]) -> tuple[str, ...]:
    """Run a check; an error of ours is a problem found."""
    try:
        check()
    except Clutter6DError as error:
        return (str(error),)
    return ()


def check_engine(dataset: Dataset) -> None:
    """Refuse to make scenes anew with another engine than the one they were settled with.

    Raises:
        InvalidValueError: It is another.
    """
    here = f"mujoco {mujoco.__version__}"
    if dataset.manifest.engine != here:
        raise InvalidValueError(f"{dataset.name} was made with {dataset.manifest.engine}, this is {here}; install that")
