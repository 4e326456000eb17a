"""Freezing: from a recipe to asset pools, scenes, and the files of a data set. Everything is resumable.

The workshop is a folder of what is made on the way: ``pools/<pool>`` is an asset library, ``splits/<split>`` a scene
set. It may be deleted afterwards, or kept to continue.
"""

import csv
import hashlib
import io
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import mujoco

from clutter6d.assets.collection import AssetCollection
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.processing import PROCESSING_VERSION, ProcessingSettings
from clutter6d.assets.run import RunSettings, run, settings_as_stored
from clutter6d.assets.sources.registry import make_source
from clutter6d.dataset.asset_pack import write_asset_pack
from clutter6d.dataset.manifest import (
    ASSET_LIST_FILE,
    ASSET_PACK_FILE,
    MANIFEST_FILE,
    Manifest,
    PoolEntry,
    Recipe,
    SplitEntry,
    SplitRecipe,
)
from clutter6d.dataset.split_file import write_split
from clutter6d.errors import InvalidValueError
from clutter6d.executor import LOCAL, Executor
from clutter6d.scenegen.certificate import GENERATOR_VERSION
from clutter6d.scenegen.generation import generate_scenes, has_scene, open_for_generation
from clutter6d.scenegen.scene_set import SceneSet, assets_sha256
from clutter6d.scenegen.track import find_track
from clutter6d.schema import write_bytes, write_model

RECIPE_FILE = "recipe.json"
Step = tuple[str, int, int]
"""What is being made, how much of it is done, and how much there is."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Workshop:
    """Where and how a data set is made.

    Attributes:
        folder: What is made on the way.
        libraries: Asset libraries given for some pools, instead of making them from their sources.
        workers: Worker processes.
        executor: Where they are.
    """

    folder: Path
    libraries: Mapping[str, Path] = field(default_factory=dict)
    workers: int = 1
    executor: Executor = LOCAL

    def pool_path(self, pool: str) -> Path:
        """The library of a pool."""
        return self.libraries.get(pool, self.folder / "pools" / pool)

    def split_path(self, split: str) -> Path:
        """The scene set of a split."""
        return self.folder / "splits" / split


def freeze(recipe: Recipe, workshop: Workshop, out: Path) -> Iterator[Step]:
    """Make a data set; yields each step as it is done, and writes the manifest last.

    Args:
        recipe: What it is made from.
        workshop: Where and how.
        out: The data set's folder.

    Raises:
        InvalidValueError: A split names a pool that the recipe lacks; a library is too small for its track; or the
            folder holds another data set.
        GenerationError: A scene could not be made; the others are kept.
        StorageError: Something could not be written.
    """
    check_recipe(recipe)
    if (out / MANIFEST_FILE).exists():
        raise InvalidValueError(f"{out} holds a frozen data set; a change is a new version, in another folder")
    for pool in recipe.pools:
        yield from _make_pool(recipe, pool, workshop)
    for split in recipe.splits:
        yield from _make_split(split, workshop)
    yield from _write(recipe, workshop, out)


def check_recipe(recipe: Recipe) -> None:
    """Refuse a recipe whose splits name pools that it lacks, or tracks that there are not.

    Raises:
        InvalidValueError: A pool is not there, or two splits share a name.
        UnknownNameError: A track is not there.
    """
    names = [split.name for split in recipe.splits]
    if len(set(names)) != len(names):
        raise InvalidValueError(f"recipe of {recipe.name}: two splits have the same name")
    for split in recipe.splits:
        find_track(split.track)
        if split.pool not in recipe.pools:
            raise InvalidValueError(
                f"recipe of {recipe.name}: split {split.name} names pool '{split.pool}', which is not there"
            )


def _make_pool(recipe: Recipe, pool: str, workshop: Workshop) -> Iterator[Step]:
    if pool in workshop.libraries:
        return
    source = make_source(recipe.pools[pool].source, **recipe.pools[pool].options)
    items, settings = source.objects(), ProcessingSettings()
    library = AssetLibrary.create(workshop.pool_path(pool), settings_as_stored(settings))
    run_settings = RunSettings(workers=workshop.workers)
    for done, _ in enumerate(run(source, items, library, settings, run_settings), start=1):
        yield f"assets of pool {pool}", done, len(items)


def _make_split(split: SplitRecipe, workshop: Workshop) -> Iterator[Step]:
    track, indices = find_track(split.track), range(split.scenes)
    library = AssetLibrary.open(workshop.pool_path(split.pool))
    scene_set = open_for_generation(library, track, split.seed, workshop.split_path(split.name))
    done = sum(has_scene(scene_set, track, split.seed, index) for index in indices)
    yield f"scenes of {split.name}", done, split.scenes
    made = generate_scenes(
        library, track, split.seed, scene_set, indices, workers=workshop.workers, executor=workshop.executor
    )
    for number, _ in enumerate(made, start=done + 1):
        yield f"scenes of {split.name}", number, split.scenes


def _write(recipe: Recipe, workshop: Workshop, out: Path) -> Iterator[Step]:
    """The files: first all others, then the manifest that names them."""
    pools = {pool: AssetLibrary.open(workshop.pool_path(pool)) for pool in recipe.pools}
    writers: list[tuple[str, Callable[[Path], object]]] = [
        (RECIPE_FILE, lambda path: write_model(path, recipe)),
        (ASSET_LIST_FILE, lambda path: write_bytes(path, asset_list(pools))),
    ]
    if recipe.ships_assets:
        writers.append((ASSET_PACK_FILE, lambda path: write_asset_pack(path, pools)))
    total = len(writers) + len(recipe.splits) + 1
    for number, (name, write) in enumerate(writers, start=1):
        write(out / name)
        yield "files", number, total
    splits: list[SplitEntry] = []
    for split in recipe.splits:
        splits.append(_write_split(split, SceneSet.open(workshop.split_path(split.name)), out))
        yield "files", len(writers) + len(splits), total
    names = [*(name for name, _ in writers), *(split.file for split in splits)]
    write_model(
        out / MANIFEST_FILE,
        Manifest(
            name=recipe.name,
            title=recipe.title,
            licence=recipe.licence,
            ships_assets=recipe.ships_assets,
            engine=f"mujoco {mujoco.__version__}",
            generator_version=GENERATOR_VERSION,
            processing_version=PROCESSING_VERSION,
            files={name: hashlib.sha256((out / name).read_bytes()).hexdigest() for name in names},
            pools={pool: _pool_entry(recipe, pool, library) for pool, library in pools.items()},
            splits=tuple(splits),
        ),
    )
    yield "files", total, total


def _write_split(split: SplitRecipe, made: SceneSet, out: Path) -> SplitEntry:
    scenes = made.scenes
    if len(scenes) != split.scenes:
        raise InvalidValueError(
            f"{made.path} holds {len(scenes)} scenes, the recipe asks for {split.scenes}; remove the folder"
        )
    file = f"{split.name}.parquet"
    write_split(out / file, scenes, [made.record(scene.scene_id).failures for scene in scenes])
    pairs = sum(len(scene.goal_pairs) for scene in scenes)
    return SplitEntry(**split.model_dump(), pairs=pairs, file=file, scenes_sha256=made.sha256)


def _pool_entry(recipe: Recipe, pool: str, library: AssetLibrary) -> PoolEntry:
    hashes = library.index()["content_hash"]
    return PoolEntry(**recipe.pools[pool].model_dump(), assets=len(hashes), sha256=assets_sha256(hashes))


def asset_list(pools: Mapping[str, AssetCollection]) -> bytes:
    """CSV with one row an asset: hash, pool, attributes, licence, author and origin."""
    text = io.StringIO()
    rows = [
        {"pool": pool, **{str(key): value for key, value in row.items() if key not in ("pool", "seconds")}}
        for pool in sorted(pools)
        for row in pools[pool].index().to_dict("records")
    ]
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()
