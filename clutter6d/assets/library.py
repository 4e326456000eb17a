"""The asset library: a folder that holds each asset under its content's hash, and a record of every object tried.

    library.json                       format, and the processing settings all its assets were made with
    assets/<name>-<hash12>/            asset.json and geometry.npz of one asset
    records/<fingerprint>.json         what became of one source object
    reviews.jsonl                      what reviewers decided, if anyone reviewed it
    annotations/<key>.json             what a vision-language model answered, if one was asked

Every file is written atomically and an asset before its record, so a run that is killed loses only what it was
working on, and a second run continues where the first ended. A changed version of an asset stands beside the old one
until the record names it; of two, the one written last counts.
"""

import os
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from clutter6d.assets.asset import Asset, Licence
from clutter6d.assets.asset_file import JSON_NAME, AssetFile, PackedAsset, read_asset, read_asset_file, write_asset
from clutter6d.assets.review.standing import rejected_hashes
from clutter6d.errors import InvalidFileError, InvalidValueError, MissingFileError, UnknownNameError
from clutter6d.schema import FileModel, read_bytes, read_model, write_model

if TYPE_CHECKING:
    import pandas as pd

LIBRARY_FILE = "library.json"
_HASH_CHARS = 12


class LibraryFile(FileModel):
    """``library.json``."""

    schema_version: Literal[1] = 1
    format: Literal["clutter6d-asset-library"] = "clutter6d-asset-library"
    settings: dict[str, Any] = Field(default_factory=dict)


class ProcessingRecord(FileModel):
    """What became of one source object.

    Attributes:
        fingerprint: Of the object and the settings; names the file.
        source: Name of the asset source.
        key: The object's key in its source.
        name: The object's name in its source.
        status: Whether it became an asset.
        reason: Why not, as a short word.
        detail: Why not, in a sentence.
        asset_hash: Content hash of the asset it became.
        asset_name: Its name in the library.
        seconds: Time it took.
        fallbacks: Every step that did not go the normal way.
    """

    schema_version: Literal[1] = 1
    fingerprint: str = Field(pattern=r"^[0-9a-f]{16,64}$")
    source: str
    key: str
    name: str
    status: Literal["accepted", "rejected"]
    reason: str = ""
    detail: str = ""
    asset_hash: str = ""
    asset_name: str = ""
    seconds: float
    fallbacks: tuple[str, ...] = ()


class AssetLibrary:
    """A folder of assets; use ``open`` or ``create``.

    Attributes:
        path: The folder.
        settings: Processing settings of all its assets, as plain values.
    """

    def __init__(self, path: Path, settings: Mapping[str, Any]) -> None:
        self.path = path
        self.settings = dict(settings)
        self._folders: dict[str, Path] | None = None
        self._written_ns: dict[str, int] = {}

    @classmethod
    def open(cls, path: Path | str) -> "AssetLibrary":
        """Open an existing library.

        Raises:
            MissingFileError: The folder does not exist or is no library.
            InvalidFileError: Its ``library.json`` is damaged.
        """
        path = Path(path)
        if not (path / LIBRARY_FILE).is_file():
            raise MissingFileError(
                "asset library", path, "make one with: clutter6d assets process SOURCE --out LIBRARY"
            )
        return cls(path, read_model(path / LIBRARY_FILE, LibraryFile, what="asset library").settings)

    @classmethod
    def create(cls, path: Path | str, settings: Mapping[str, Any] | None = None) -> "AssetLibrary":
        """Open a library, or make a new one.

        Raises:
            InvalidValueError: The library exists and was made with other processing settings.
            StorageError: The folder cannot be written.
        """
        path, wanted = Path(path), dict(settings or {})
        if (path / LIBRARY_FILE).exists():
            library = cls.open(path)
            differing = [key for key in {*wanted, *library.settings} if wanted.get(key) != library.settings.get(key)]
            if settings is not None and differing:
                names = ", ".join(sorted(differing))
                raise InvalidValueError(f"library {path} was made with other settings ({names}); choose another --out")
            return library
        if path.is_dir() and any(path.iterdir()):
            raise InvalidValueError(f"{path} is neither empty nor an asset library; choose another --out")
        write_model(path / LIBRARY_FILE, LibraryFile(settings=wanted))
        return cls(path, wanted)

    def names(self, *, with_rejected: bool = False) -> tuple[str, ...]:
        """Names of the assets, sorted; of those that a reviewer rejected only if asked for.

        Raises:
            InvalidFileError: The journal of the reviews is damaged.
        """
        rejected = () if with_rejected else {key[:_HASH_CHARS] for key in rejected_hashes(self.path)}
        return tuple(sorted(name for name, path in self._by_name().items() if path.name[-_HASH_CHARS:] not in rejected))

    def load(self, name_or_hash: str) -> Asset:
        """Read one asset and check its hash.

        Args:
            name_or_hash: The asset's name, or at least 12 characters of its content hash.

        Raises:
            UnknownNameError: There is no such asset.
            InvalidFileError: The asset is damaged.
        """
        folder = self._find(name_or_hash)
        asset = read_asset(folder)
        if folder.name != _folder_name(asset.name, asset.content_hash):
            raise InvalidFileError(folder, f"the folder's name does not fit its asset {asset.name}")
        return asset

    def describe(self, name_or_hash: str) -> AssetFile:
        """Read what is said of one asset, without its geometry.

        Raises:
            UnknownNameError: There is no such asset.
            InvalidFileError: Its file is damaged.
        """
        return read_asset_file(self._find(name_or_hash))

    def add(self, asset: Asset) -> Asset:
        """Store an asset; replaces an earlier version of the same source object.

        Returns:
            The asset as stored: if its name belongs to another object, it gets six characters of its hash.

        Raises:
            StorageError: The disk is full or the folder cannot be written.
        """
        asset = replace(asset, name=self._free_name(asset.name, asset.content_hash, asset.licence))
        self._put(asset.name, asset.content_hash, asset)
        return asset

    def add_packed(self, packed: PackedAsset) -> AssetFile:
        """Store an asset that was packed elsewhere; as :meth:`add`.

        Returns:
            What is said of the asset as stored.
        """
        file = packed.description
        licence = Licence(**file.licence.model_dump())
        file = file.model_copy(update={"name": self._free_name(file.name, file.content_hash, licence)})
        self._put(file.name, file.content_hash, PackedAsset(description=file, geometry=packed.geometry))
        return file

    def _free_name(self, name: str, content_hash: str, licence: Licence) -> str:
        """The name, unless it belongs to another object already."""
        self._finish_replacements()
        earlier = self._by_name().get(name)
        return name if earlier is None or _is_same_object(earlier, licence) else f"{name}-{content_hash[:6]}"

    def _put(self, name: str, content_hash: str, asset: Asset | PackedAsset) -> None:
        """Write what is not there yet, and take the place of an earlier version."""
        earlier = self._by_name().get(name)
        folder = self.path / "assets" / _folder_name(name, content_hash)
        if not (folder / JSON_NAME).exists():
            write_asset(folder, asset)
        if earlier is not None and earlier != folder:
            self._remove(earlier)
        self._note(name, folder)

    def replace(self, old_hash: str, asset: Asset) -> Asset:
        """Store a changed version of an asset in the old one's place, and let the old one's record name it.

        After a kill at any moment the library holds the old version or the new; the next ``replace`` or ``add``
        clears up. Processing its source again leaves the new version alone.

        Args:
            old_hash: Content hash of the version that the change was made from.
            asset: The new version.

        Returns:
            The asset as stored, under the old one's name.

        Raises:
            UnknownNameError: The library holds no such version (any more).
            StorageError: The disk is full or the folder cannot be written; the old version is still there.
        """
        self._finish_replacements()
        old = self._find(old_hash)
        asset = replace(asset, name=_asset_name(old))
        folder = self.path / "assets" / _folder_name(asset.name, asset.content_hash)
        if folder != old:
            write_asset(folder, asset)
            self._supersede(old, folder)
            self._note(asset.name, folder)
        return asset

    def record(self, fingerprint: str) -> ProcessingRecord | None:
        """The record of a source object, or ``None`` if it was not processed, or its asset is gone."""
        path = self._record_path(fingerprint)
        if not path.exists():
            return None
        try:
            record = read_model(path, ProcessingRecord, what="processing record")
        except InvalidFileError:
            return None
        if record.status == "accepted":
            folder = self.path / "assets" / _folder_name(record.asset_name, record.asset_hash)
            return record if (folder / JSON_NAME).exists() else None
        return record

    def add_record(self, record: ProcessingRecord) -> None:
        """Store what became of a source object; call it after its asset was added."""
        write_model(self._record_path(record.fingerprint), record)

    def forget(self, fingerprint: str) -> None:
        """Drop the record of a source object, so that the object is processed again; its asset stays until then."""
        self._record_path(fingerprint).unlink(missing_ok=True)

    def records(self) -> tuple[ProcessingRecord, ...]:
        """All records, by source and key."""
        paths = sorted((self.path / "records").glob("*.json"))
        records = [read_model(path, ProcessingRecord, what="processing record") for path in paths]
        return tuple(sorted(records, key=lambda record: (record.source, record.key)))

    def verify(self) -> tuple[str, ...]:
        """Look at the folder afresh; read and check everything.

        Returns:
            One line per problem; none if every asset has its hash and every record its asset.
        """
        self._folders = None
        problems: list[str] = []
        for name in self.names(with_rejected=True):
            try:
                self.load(name)
            except (InvalidFileError, MissingFileError) as error:
                problems.append(str(error))
        for path in sorted((self.path / "records").glob("*.json")):
            try:
                record = read_model(path, ProcessingRecord, what="processing record")
            except InvalidFileError as error:
                problems.append(str(error))
                continue
            if path.stem != record.fingerprint or self.record(path.stem) is None:
                problems.append(f"{path}: names asset {record.asset_name}, which is not there; process again")
        try:
            rejected_hashes(self.path)
        except InvalidFileError as error:
            problems.append(str(error))
        return tuple(problems)

    def index(self) -> "pd.DataFrame":
        """One row per asset that no reviewer rejected: name, hash, category, size, mass, parts, licence and origin."""
        from clutter6d.assets.library_index import make_index

        return make_index(self.describe(name) for name in self.names())

    def _record_path(self, fingerprint: str) -> Path:
        return self.path / "records" / f"{fingerprint}.json"

    def _by_name(self) -> dict[str, Path]:
        if self._folders is None:
            self._look()
            self._folders = {_asset_name(path): path for path in self._whole_folders()}
        return self._folders

    def _note(self, name: str, folder: Path) -> None:
        """Know an asset that this object stored, so that the next one need not look at all folders again."""
        self._by_name()[name] = folder
        self._written_ns[folder.name] = (folder / JSON_NAME).stat().st_mtime_ns

    def _look(self) -> bool:
        """Find what was stored or removed since; only folders not known yet are opened. Returns whether any was."""
        assets = self.path / "assets"
        if not assets.is_dir():
            return False
        with os.scandir(assets) as entries:
            there = {entry.name for entry in entries}
        gone = self._written_ns.keys() - there
        files = {name: assets / name / JSON_NAME for name in there - self._written_ns.keys()}
        new = {name: file.stat().st_mtime_ns for name, file in files.items() if file.exists()}
        for name in gone:
            del self._written_ns[name]
        self._written_ns.update(new)
        return bool(gone or new)

    def _whole_folders(self) -> list[Path]:
        """Folders of assets, the last written last: a version that is whole stands before an earlier one."""
        names = sorted(self._written_ns, key=lambda name: (self._written_ns[name], name))
        return [self.path / "assets" / name for name in names]

    def _finish_replacements(self) -> None:
        """Look for what other processes did, and finish what a kill interrupted: one folder a name."""
        if not self._look() and self._folders is not None and len(self._folders) == len(self._written_ns):
            return
        folders = self._whole_folders()
        self._folders = newest = {_asset_name(path): path for path in folders}
        for folder in folders:
            if newest[_asset_name(folder)] != folder:
                self._supersede(folder, newest[_asset_name(folder)])

    def _supersede(self, old: Path, new: Path) -> None:
        """Let records of the asset in one folder name that in another, then remove the one folder."""
        name, prefix, new_hash = _asset_name(old), old.name[-_HASH_CHARS:], read_asset_file(new).content_hash
        for path in (self.path / "records").glob("*.json"):
            if f'"{prefix}'.encode() not in read_bytes(path, what="processing record"):
                continue
            record = read_model(path, ProcessingRecord, what="processing record")
            if record.asset_name == name and record.asset_hash.startswith(prefix):
                self.add_record(record.model_copy(update={"asset_hash": new_hash}))
        self._remove(old)

    def _remove(self, folder: Path) -> None:
        """Remove an asset; its description goes first, so that half a folder does not count as one."""
        (folder / JSON_NAME).unlink(missing_ok=True)
        shutil.rmtree(folder, ignore_errors=True)
        self._written_ns.pop(folder.name, None)

    def _find(self, name_or_hash: str) -> Path:
        by_name = self._by_name()
        if name_or_hash in by_name:
            return by_name[name_or_hash]
        prefix = name_or_hash[:_HASH_CHARS]
        for path in by_name.values():
            is_near = len(prefix) == _HASH_CHARS and path.name.endswith(f"-{prefix}")
            if is_near and read_asset_file(path).content_hash.startswith(name_or_hash):
                return path
        raise UnknownNameError(f"asset of library {self.path}", name_or_hash, by_name)


def _folder_name(name: str, content_hash: str) -> str:
    return f"{name}-{content_hash[:_HASH_CHARS]}"


def _asset_name(folder: Path) -> str:
    return folder.name[: -_HASH_CHARS - 1]


def _is_same_object(folder: Path, licence: Licence) -> bool:
    earlier = read_asset_file(folder).licence
    return (earlier.source, earlier.source_id) == (licence.source, licence.source_id)
