"""Objaverse 1.0 through its own package: licences and sizes are judged by the annotations, before any download."""

import contextlib
import hashlib
import importlib
import importlib.util
import io
import logging
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, cast

from clutter6d.assets.mesh_io import MeshLimits, read_mesh_file
from clutter6d.assets.sources.base import RawShape, SourceObject
from clutter6d.assets.sources.objaverse_annotation import (
    LICENCES,
    PERMISSIVE,
    TABLETOP_CATEGORIES,
    Downloader,
    annotations_online,
    parse_annotation,
)
from clutter6d.assets.sources.objaverse_list import ListedObject, check_list, read_list
from clutter6d.errors import InvalidValueError, MeshRejectedError, MissingDependencyError, UnknownNameError

_LOG = logging.getLogger(__name__)
_LOADER_VERSION = "1"


class ObjaverseSource:
    """Objects of Objaverse 1.0: those of a curated list, or chosen by uid or by LVIS category.

    Args:
        list_file: A curated list (CSV); no annotation is read then, and the other ways to choose are left out.
        listed: The same as values: one mapping an object.
        count: At most so many objects; all that pass if ``None``.
        uids: The objects to choose from; if ``None``, those of the categories.
        categories: LVIS categories to choose from; things of a table-top if ``None``.
        licences: Licences that pass; see ``LICENCES``. NC, ND and SA have to be asked for.
        limits: Largest mesh (paper, "Object Selection and Geometry Filtering"), applied before the download.
        downloader: Stands in for the ``objaverse`` package.

    Raises:
        MissingDependencyError: The ``objaverse`` package is not installed.
        MissingFileError: The list is not there.
        InvalidFileError: The list is damaged.
        UnknownNameError: A licence is not one of Objaverse's.
        InvalidValueError: The count is negative.
    """

    name = "objaverse"

    def __init__(
        self,
        *,
        list_file: Path | str | None = None,
        listed: Sequence[Mapping[str, Any]] | None = None,
        count: int | None = 256,
        uids: Sequence[str] | None = None,
        categories: Sequence[str] | None = None,
        licences: Sequence[str] = PERMISSIVE,
        limits: MeshLimits | None = None,
        downloader: Downloader | None = None,
    ) -> None:
        if downloader is None:
            check_package()
        if count is not None and count < 0:
            raise InvalidValueError(f"objaverse: count is {count}; it must not be negative")
        check_licences(licences)
        self._count, self._licences, self._limits = count, tuple(licences), limits or MeshLimits()
        self._uids, self._categories = uids, categories
        self._downloader = downloader
        self._listed: tuple[ListedObject, ...] = ()
        if list_file is not None:
            self._listed = read_list(Path(list_file))
        elif listed is not None:
            self._listed = check_list(listed, "objaverse: listed")

    def objects(self) -> Sequence[SourceObject]:
        """The objects of the list; or those that pass, category by category in turn, for which annotations are read.

        Raises:
            UnknownNameError: A category is not one of LVIS.
            StorageError: The annotations could not be downloaded.
        """
        return self._selection[0]

    @property
    def refused(self) -> Mapping[str, int]:
        """How many objects were left out before any download, by reason."""
        return MappingProxyType(self._selection[1])

    def fingerprint(self, item: SourceObject) -> str:
        """Hash of the uid and the limits: an object of Objaverse 1.0 never changes."""
        return hashlib.sha256(repr((_LOADER_VERSION, "objaverse-1.0", item.key, self._limits)).encode()).hexdigest()

    def load(self, item: SourceObject) -> RawShape:
        """Download the object if it is not there yet, and read it; its unit is unknown.

        Raises:
            MeshRejectedError: It could not be downloaded, or cannot be used.
        """
        try:
            with contextlib.redirect_stdout(io.StringIO()):  # the package prints its progress
                path = self._api.load_objects([item.key]).get(item.key)
        except OSError as error:
            raise MeshRejectedError("unavailable", f"{item.key} could not be downloaded ({error})") from None
        if path is None or not Path(path).is_file():
            raise MeshRejectedError("unavailable", f"{item.key} is not in Objaverse 1.0")
        return read_mesh_file(Path(path), up="y", limits=self._limits)

    @property
    def _api(self) -> Downloader:
        return self._downloader or open_package()

    @cached_property
    def _selection(self) -> tuple[tuple[SourceObject, ...], dict[str, int]]:
        if self._listed:
            return tuple(item.as_source_object() for item in self._listed), {}
        chosen: list[SourceObject] = []
        refused: Counter[str] = Counter()
        with annotations_online():
            candidates = self._candidates()
            records = self._api.load_annotations(list(candidates)) if candidates else {}
        for uid, category in candidates.items():
            annotation = parse_annotation(records.get(uid))
            reason = "no-annotation" if annotation is None else annotation.refusal(self._licences, self._limits)
            if annotation is None or reason is not None:
                refused[reason or "no-annotation"] += 1
            elif self._count is None or len(chosen) < self._count:
                chosen.append(ListedObject.of(category, annotation).as_source_object())
        _LOG.info("Objaverse: %d objects chosen; refused before download: %s", len(chosen), dict(refused))
        return tuple(chosen), dict(refused)

    def _candidates(self) -> dict[str, str | None]:
        """Each uid with its category, one of each category in turn."""
        if self._uids is not None:
            return dict.fromkeys(self._uids)
        lvis = self._api.load_lvis_annotations()
        names = check_categories(self._categories, lvis)
        ranked = [
            (rank, column, uid) for column, name in enumerate(names) for rank, uid in enumerate(sorted(lvis[name]))
        ]
        return {uid: names[column] for _, column, uid in sorted(ranked)}


def open_package() -> Downloader:
    """The ``objaverse`` package.

    Raises:
        MissingDependencyError: It is not installed.
    """
    check_package()
    try:
        return cast(Downloader, importlib.import_module("objaverse"))
    except ImportError as error:
        raise MissingDependencyError(
            f"the package 'objaverse' is damaged ({error}); run: pip install --force-reinstall 'clutter6d[sources]'"
        ) from None


def check_package() -> None:
    """Say how to install the package if it is not.

    Raises:
        MissingDependencyError: It is not installed.
    """
    if importlib.util.find_spec("objaverse") is None:
        raise MissingDependencyError(
            "the objaverse source needs the package 'objaverse': pip install 'clutter6d[sources]'"
        )


def check_licences(licences: Sequence[str]) -> None:
    """Refuse a licence that is not one of Objaverse's.

    Raises:
        UnknownNameError: It is not.
    """
    for licence in licences:
        if licence not in LICENCES:
            raise UnknownNameError("Objaverse licence", licence, LICENCES)


def check_categories(categories: Sequence[str] | None, lvis: Mapping[str, object]) -> list[str]:
    """The categories to choose from; things of a table-top if none are given.

    Raises:
        UnknownNameError: One is not of LVIS.
    """
    if categories is None:
        return [name for name in TABLETOP_CATEGORIES if name in lvis]
    for name in categories:
        if name not in lvis:
            raise UnknownNameError("LVIS category", name, lvis)
    return list(categories)
