"""A frozen data set: a folder with a manifest, found by name where this package keeps its own, or anywhere by path.

manifest.json      names, versions, the SHA-256 of every other file
recipe.json        what it was made from
asset_list.csv     every asset with its hash, pool, attributes, licence, author and origin
assets.parquet     the assets themselves, where the data set carries them
<split>.parquet    the scenes of one split
"""

import hashlib
import io
from functools import cached_property
from pathlib import Path

import pandas as pd

from clutter6d.assets.cache import cache_folder
from clutter6d.assets.collection import AssetCollection, AssetPool
from clutter6d.assets.library import AssetLibrary
from clutter6d.dataset.asset_pack import AssetPack
from clutter6d.dataset.manifest import ASSET_LIST_FILE, ASSET_PACK_FILE, MANIFEST_FILE, Manifest
from clutter6d.dataset.split import Split
from clutter6d.errors import InvalidFileError, MissingFileError, UnknownNameError
from clutter6d.schema import read_bytes, read_model

DEFAULT_DATASET = "clutter6d-v1"
_MAX_ASSET_LIST_BYTES = 64 << 20
_PACKAGE = Path(__file__).parents[1]


def datasets_folder() -> Path:
    """Where the data sets that come with this package are: inside an installed package, or beside a checkout's."""
    installed = _PACKAGE / "datasets"
    return installed if installed.is_dir() else _PACKAGE.parent / "datasets"


def dataset_names() -> tuple[str, ...]:
    """Names of the data sets that come with this package."""
    return tuple(sorted(path.parent.name for path in datasets_folder().glob(f"*/{MANIFEST_FILE}")))


def open_dataset(name_or_folder: str | Path) -> "Dataset":
    """A data set by name, or by its folder.

    Raises:
        UnknownNameError: Neither a data set's name nor its folder.
        InvalidFileError: Its manifest is damaged.
    """
    for folder in (Path(name_or_folder), datasets_folder() / name_or_folder):
        if (folder / MANIFEST_FILE).is_file():
            return Dataset(folder)
    raise UnknownNameError("data set (and no folder of one)", str(name_or_folder), dataset_names())


class Dataset:
    """A frozen data set.

    Args:
        path: Its folder.

    Raises:
        MissingFileError: It holds no manifest.
        InvalidFileError: The manifest is damaged.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.manifest = read_model(path / MANIFEST_FILE, Manifest, what="data set manifest")

    @property
    def name(self) -> str:
        """Name and version."""
        return self.manifest.name

    @property
    def split_names(self) -> tuple[str, ...]:
        """Names of its splits."""
        return tuple(entry.name for entry in self.manifest.splits)

    def split(self, name: str) -> Split:
        """A split, its file checked against the manifest.

        Raises:
            UnknownNameError: There is no such split.
            InvalidFileError: Its file is not the one that was frozen.
        """
        entry = next((entry for entry in self.manifest.splits if entry.name == name), None)
        if entry is None:
            raise UnknownNameError(f"split of {self.name}", name, self.split_names)
        split = Split(self.path / entry.file, entry, self.assets)
        self.check_file(entry.file, split.content)
        return split

    @cached_property
    def assets(self) -> AssetCollection:
        """The assets of all its scenes.

        Raises:
            InvalidFileError: The file of the assets is not the one that was frozen.
            MissingFileError: The data set does not carry its assets, and they are not installed.
        """
        if self.manifest.ships_assets:
            pack = AssetPack(self.path / ASSET_PACK_FILE)
            self.check_file(ASSET_PACK_FILE, pack.content)
            return pack
        if not self.library_path.is_dir():
            raise MissingFileError(
                f"library of {self.name}'s assets", self.library_path, f"run: clutter6d dataset install {self.name}"
            )
        return AssetLibrary.open(self.library_path)

    @property
    def library_path(self) -> Path:
        """Where assets that the data set does not carry are installed."""
        return cache_folder() / self.name

    @cached_property
    def asset_list(self) -> pd.DataFrame:
        """One row an asset: hash, pool, attributes, licence, author, origin.

        Raises:
            InvalidFileError: It is not the list that was frozen.
        """
        path = self.path / ASSET_LIST_FILE
        content = read_bytes(path, what="asset list", max_bytes=_MAX_ASSET_LIST_BYTES)
        self.check_file(ASSET_LIST_FILE, content)
        return pd.read_csv(io.BytesIO(content), keep_default_na=False)

    def pool(self, name: str) -> AssetPool:
        """The assets that the scenes of some splits are made from.

        Raises:
            UnknownNameError: There is no such pool.
        """
        if name not in self.manifest.pools:
            raise UnknownNameError(f"asset pool of {self.name}", name, self.manifest.pools)
        rows = self.asset_list
        return AssetPool(self.assets, rows["name"][rows["pool"] == name])

    def check_file(self, name: str, content: bytes) -> None:
        """Refuse a file whose content is not the frozen one.

        Raises:
            InvalidFileError: It is not.
        """
        expected, found = self.manifest.files.get(name, ""), hashlib.sha256(content).hexdigest()
        if found != expected:
            problem = f"SHA-256 is {found[:12]}, the manifest says {expected[:12] or 'nothing'}"
            raise InvalidFileError(self.path / name, f"{problem}; restore the file that was frozen")
