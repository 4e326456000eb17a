"""What a card or a comparison is about: a data set, one frozen split, or a folder of generated scenes."""

import hashlib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from clutter6d.assets.asset import Asset
from clutter6d.assets.collection import AssetCollection
from clutter6d.dataset.dataset import Dataset, dataset_names, open_dataset
from clutter6d.dataset.manifest import MANIFEST_FILE
from clutter6d.dataset.scenes import SceneCollection, load_split, split_names
from clutter6d.dataset.split import Split
from clutter6d.errors import UnknownNameError
from clutter6d.scenegen.scene_set import HEADER, SceneSet

Facts = Sequence[tuple[str, str]]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class CardSubject:
    """Splits and assets under one name.

    Attributes:
        name: Of the data set, the split or the folder.
        facts: How it was made, as names and values.
        splits: The scenes of each split.
        assets: One row an asset, with the columns of a library's index and ``pool``.
        load_asset: Reads one asset by its name.
        failures: Failed draws of each split by reason.
    """

    name: str
    facts: Facts
    splits: Mapping[str, SceneCollection]
    assets: pd.DataFrame
    load_asset: Callable[[str], Asset]
    failures: Mapping[str, Mapping[str, int]]


def open_subject(name_or_folder: str) -> CardSubject:
    """A data set by name or folder; else a frozen split by name, or a folder of scenes, as a set of one split.

    Raises:
        UnknownNameError: It is none of these.
        InvalidFileError: What is there is damaged.
        MissingFileError: The data set's assets are not installed.
    """
    path = Path(name_or_folder)
    if name_or_folder in dataset_names() or (path / MANIFEST_FILE).is_file():
        return _of_dataset(open_dataset(name_or_folder))
    if (path / HEADER).is_file():
        return _of_folder(SceneSet.open(path))
    try:
        return _of_split(name_or_folder, load_split(name_or_folder))
    except UnknownNameError:
        known = [*dataset_names(), *split_names()]
        raise UnknownNameError("data set, split or folder of scenes", name_or_folder, known) from None


def _of_dataset(dataset: Dataset) -> CardSubject:
    splits = {name: dataset.split(name) for name in dataset.split_names}
    return CardSubject(
        name=dataset.name,
        facts=_facts_of(dataset),
        splits=splits,
        assets=dataset.asset_list,
        load_asset=dataset.assets.load,
        failures={name: _sum(split.failures()) for name, split in splits.items()},
    )


def _facts_of(dataset: Dataset) -> Facts:
    manifest = dataset.manifest
    pools = [
        (
            f"pool {name}",
            f"{pool.assets:,} assets, {pool.description or 'all'}; source {pool.source}{_said(pool.options)}",
        )
        for name, pool in manifest.pools.items()
    ]
    splits = [
        (f"split {split.name}", f"track {split.track}, pool {split.pool}, seed {split.seed}")
        for split in manifest.splits
    ]
    return (
        ("licence of the scenes", manifest.licence),
        ("engine", manifest.engine),
        ("scene generator, asset processing", f"{manifest.generator_version}, {manifest.processing_version}"),
        *pools,
        *splits,
        ("manifest SHA-256", hashlib.sha256((dataset.path / MANIFEST_FILE).read_bytes()).hexdigest()),
    )


def _said(options: Mapping[str, object]) -> str:
    """The short ones of a source's options."""
    return "".join(f", {name} {value}" for name, value in options.items() if isinstance(value, str | int | float))


def _of_split(name: str, split: Split) -> CardSubject:
    entry = split.entry
    return CardSubject(
        name=name,
        facts=(("track", entry.track), ("pool", entry.pool), ("seed", str(entry.seed))),
        splits={split.name: split},
        assets=_used(split, split.assets, entry.pool),
        load_asset=split.assets.load,
        failures={split.name: _sum(split.failures())},
    )


def _of_folder(scenes: SceneSet) -> CardSubject:
    _ = scenes.scenes  # a damaged one is refused here
    header, split = scenes.header, scenes.path.resolve().name
    return CardSubject(
        name=split,
        facts=(
            ("track", header.track),
            ("seed", str(header.seed)),
            ("scene generator", header.generator_version),
            ("asset library SHA-256", header.library_sha256),
        ),
        splits={split: scenes},
        assets=_used(scenes, scenes.library, "used"),
        load_asset=scenes.library.load,
        failures={split: scenes.failures()},
    )


def _used(scenes: SceneCollection, assets: AssetCollection, pool: str) -> pd.DataFrame:
    """The index of the assets that scenes use."""
    hashes = {item.asset_hash for scene in scenes.scenes for item in scene.objects}
    rows = assets.index()
    return rows[rows["content_hash"].isin(hashes)].assign(pool=pool).reset_index(drop=True)


def _sum(failures: Sequence[Mapping[str, int]]) -> Counter[str]:
    total: Counter[str] = Counter()
    for counts in failures:
        total.update(counts)
    return total
