"""``manifest.json``: what a frozen data set consists of, with the SHA-256 of every file; and its recipe."""

from typing import Any, Literal

from pydantic import Field

from clutter6d.schema import FileModel

MANIFEST_FILE = "manifest.json"
ASSET_LIST_FILE = "asset_list.csv"
ASSET_PACK_FILE = "assets.parquet"
NAME_PATTERN = r"^[a-z0-9][a-z0-9.-]{0,63}$"
_SHA256 = r"^[0-9a-f]{64}$"


class PoolRecipe(FileModel):
    """Where the assets of one pool come from.

    Attributes:
        source: Name of an asset source.
        options: What the source is given.
        description: Which objects these are.
    """

    source: str
    options: dict[str, Any] = Field(default_factory=dict)
    description: str = ""


class SplitRecipe(FileModel):
    """Scenes ``0`` to ``scenes - 1`` of a seed, of one track, from the assets of one pool."""

    name: str = Field(pattern=NAME_PATTERN)
    track: str
    pool: str
    seed: int
    scenes: int = Field(ge=1, le=1_000_000)


class Recipe(FileModel):
    """What a data set is made from; ``recipe.json``.

    Attributes:
        name: The data set's name and version.
        title: One line.
        licence: Under which terms scenes and shipped assets are given.
        ships_assets: Whether the data set carries its assets, or names them by hash for the user to install.
        pools: Asset pools by name.
        splits: Its splits.
    """

    schema_version: Literal[1] = 1
    name: str = Field(pattern=NAME_PATTERN)
    title: str
    licence: str
    ships_assets: bool
    pools: dict[str, PoolRecipe]
    splits: tuple[SplitRecipe, ...] = Field(min_length=1)


class SplitEntry(SplitRecipe):
    """A frozen split.

    Attributes:
        pairs: Goal pairs of all its scenes.
        file: Its Parquet file.
        scenes_sha256: Hash over the hashes of its scenes; the split's name in every table.
    """

    pairs: int
    file: str = Field(pattern=r"^[a-z0-9][a-z0-9.-]{0,63}\.parquet$")
    scenes_sha256: str = Field(pattern=_SHA256)


class PoolEntry(PoolRecipe):
    """A frozen pool.

    Attributes:
        assets: Number of assets.
        sha256: Hash over their content hashes.
    """

    assets: int
    sha256: str = Field(pattern=_SHA256)


class Manifest(FileModel):
    """``manifest.json``.

    Attributes:
        name: The data set's name and version.
        title: One line.
        licence: Terms of scenes and shipped assets.
        ships_assets: Whether it carries its assets.
        engine: The simulation engine that settled the scenes, with its version.
        generator_version: Version of the scene generator.
        processing_version: Version of the asset processing.
        files: SHA-256 of every other file, by name.
        pools: Its asset pools.
        splits: Its splits.
    """

    schema_version: Literal[1] = 1
    format: Literal["clutter6d-dataset"] = "clutter6d-dataset"
    name: str = Field(pattern=NAME_PATTERN)
    title: str
    licence: str
    ships_assets: bool
    engine: str
    generator_version: str
    processing_version: int
    files: dict[str, str]
    pools: dict[str, PoolEntry]
    splits: tuple[SplitEntry, ...]
