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
from typing import Any, Protocol, cast, runtime_checkable

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from clutter6d.assets.asset import Licence
from clutter6d.assets.mesh_io import MeshLimits, read_mesh_file
from clutter6d.assets.slug import slugify
from clutter6d.assets.sources.base import AttributeHints, RawShape, SourceObject
from clutter6d.errors import (
    InvalidValueError,
    MeshRejectedError,
    MissingDependencyError,
    StorageError,
    UnknownNameError,
)

_LOG = logging.getLogger(__name__)
_LOADER_VERSION = "1"

LICENCES: Mapping[str, str] = MappingProxyType(
    {
        "cc0": "CC0-1.0",
        "by": "CC-BY-4.0",
        "by-sa": "CC-BY-SA-4.0",
        "by-nd": "CC-BY-ND-4.0",
        "by-nc": "CC-BY-NC-4.0",
        "by-nc-sa": "CC-BY-NC-SA-4.0",
        "by-nc-nd": "CC-BY-NC-ND-4.0",
    }
)
"""The licences of Objaverse's annotations and their SPDX names."""

PERMISSIVE = ("cc0", "by")

TABLETOP_CATEGORIES = (
    "apple", "banana", "beer_bottle", "beer_can", "book", "bottle", "bowl", "box", "camera", "candle", "carton",
    "cellular_telephone", "clothespin", "coffeepot", "cup", "doughnut", "dumbbell", "duck", "figurine", "flashlight",
    "flower_vase", "fork", "frying_pan", "game_controller", "hammer", "jar", "jug", "kettle", "knife", "ladle",
    "milk_can", "mug", "padlock", "pear", "perfume", "pitcher_(vessel_for_liquid)", "plate", "pliers", "remote_control",
    "saltshaker", "saucepan", "screwdriver", "shoe", "soap", "spatula", "spoon", "stapler_(stapling_machine)",
    "tape_measure", "teacup", "teapot", "thermos_bottle", "tin_can", "toy", "vase", "watering_can", "wrench",
)  # fmt: skip
"""LVIS categories of things that stand on a table."""


@runtime_checkable
class Downloader(Protocol):
    """The part of the ``objaverse`` package that is used."""

    def load_annotations(self, uids: list[str]) -> Mapping[str, Any]:
        """Annotations by uid, for those that exist."""
        ...

    def load_lvis_annotations(self) -> Mapping[str, list[str]]:
        """The uids of each LVIS category."""
        ...

    def load_objects(self, uids: list[str]) -> Mapping[str, str]:
        """Download, and give the local path of each GLB file."""
        ...


class _Record(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class _User(_Record):
    username: str = ""
    display_name: str = Field("", alias="displayName")


class _Archive(_Record):
    size: int | None = None
    vertex_count: int | None = Field(None, alias="vertexCount")


class Annotation(_Record):
    """What is used of one object's annotation; everything else that Objaverse states is ignored."""

    uid: str
    name: str = ""
    license: str | None = None
    viewer_url: str = Field("", alias="viewerUrl")
    user: _User = _User.model_validate({})
    vertex_count: int | None = Field(None, alias="vertexCount")
    archives: dict[str, _Archive] = {}
    is_age_restricted: bool = Field(False, alias="isAgeRestricted")

    @property
    def author(self) -> str:
        """Whom an attribution names."""
        return self.user.display_name or self.user.username

    @property
    def glb(self) -> _Archive:
        """What is known of its GLB file."""
        return self.archives.get("glb", _Archive.model_validate({}))

    def refusal(self, licences: Sequence[str], limits: MeshLimits) -> str | None:
        """Why the object is not even downloaded; a size that is not stated is judged after the download."""
        if self.license not in licences:
            return "licence"
        if self.license != "cc0" and not self.author:
            return "no-author"
        if self.is_age_restricted:
            return "age-restricted"
        if max(self.vertex_count or 0, self.glb.vertex_count or 0) > limits.max_vertices:
            return "too-many-vertices"
        if (self.glb.size or 0) > limits.max_bytes:
            return "too-large"
        return None


class ObjaverseSource:
    """Objects of Objaverse 1.0, chosen by uid or by LVIS category.

    Args:
        count: At most so many objects; all that pass if ``None``.
        uids: The objects to choose from; if ``None``, those of the categories.
        categories: LVIS categories to choose from; things of a table-top if ``None``.
        licences: Licences that pass; see ``LICENCES``. NC, ND and SA have to be asked for.
        limits: Largest mesh (paper, "Object Selection and Geometry Filtering"), applied before the download.
        downloader: Stands in for the ``objaverse`` package.

    Raises:
        MissingDependencyError: The ``objaverse`` package is not installed.
        UnknownNameError: A licence is not one of Objaverse's.
        InvalidValueError: The count is negative.
    """

    name = "objaverse"

    def __init__(
        self,
        *,
        count: int | None = 256,
        uids: Sequence[str] | None = None,
        categories: Sequence[str] | None = None,
        licences: Sequence[str] = PERMISSIVE,
        limits: MeshLimits | None = None,
        downloader: Downloader | None = None,
    ) -> None:
        if downloader is None and importlib.util.find_spec("objaverse") is None:
            raise MissingDependencyError(
                "the objaverse source needs the package 'objaverse': pip install 'clutter6d[sources]'"
            )
        if count is not None and count < 0:
            raise InvalidValueError(f"objaverse: count is {count}; it must not be negative")
        for licence in licences:
            if licence not in LICENCES:
                raise UnknownNameError("Objaverse licence", licence, LICENCES)
        self._count, self._licences, self._limits = count, tuple(licences), limits or MeshLimits()
        self._uids, self._categories = uids, categories
        self._downloader = downloader

    def objects(self) -> Sequence[SourceObject]:
        """The objects that pass, category by category in turn; reads annotations only.

        Raises:
            UnknownNameError: A category is not one of LVIS.
            StorageError: The annotations could not be downloaded.
        """
        return self._selection[0]

    @property
    def refused(self) -> Mapping[str, int]:
        """How many objects were left out before any download, by reason."""
        return self._selection[1]

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
        return self._downloader or cast(Downloader, importlib.import_module("objaverse"))

    @cached_property
    def _selection(self) -> tuple[tuple[SourceObject, ...], Mapping[str, int]]:
        chosen: list[SourceObject] = []
        refused: Counter[str] = Counter()
        try:
            candidates = self._candidates()
            records = self._api.load_annotations(list(candidates)) if candidates else {}
        except OSError as error:
            raise StorageError(f"Objaverse's annotations could not be downloaded ({error}); try again online") from None
        for uid, category in candidates.items():
            annotation = _annotation(records.get(uid))
            reason = "no-annotation" if annotation is None else annotation.refusal(self._licences, self._limits)
            if annotation is None or reason is not None:
                refused[reason or "no-annotation"] += 1
            elif self._count is None or len(chosen) < self._count:
                chosen.append(_listed(uid, category, annotation))
        _LOG.info("Objaverse: %d objects chosen; refused before download: %s", len(chosen), dict(refused))
        return tuple(chosen), MappingProxyType(dict(refused))

    def _candidates(self) -> dict[str, str | None]:
        """Each uid with its category, one of each category in turn."""
        if self._uids is not None:
            return dict.fromkeys(self._uids)
        lvis = self._api.load_lvis_annotations()
        names = [name for name in TABLETOP_CATEGORIES if name in lvis] if self._categories is None else self._categories
        for name in names:
            if name not in lvis:
                raise UnknownNameError("LVIS category", name, lvis)
        ranked = [
            (rank, column, uid) for column, name in enumerate(names) for rank, uid in enumerate(sorted(lvis[name]))
        ]
        return {uid: names[column] for _, column, uid in sorted(ranked)}


def _annotation(record: object) -> Annotation | None:
    try:
        return Annotation.model_validate(record)
    except ValidationError:
        return None


def _listed(uid: str, category: str | None, annotation: Annotation) -> SourceObject:
    licence = Licence(
        name=LICENCES[annotation.license or ""],
        author=annotation.author,
        source="objaverse",
        source_id=uid,
        url=annotation.viewer_url,
    )
    slug = slugify(category or annotation.name)
    return SourceObject(
        key=uid,
        name=slugify(f"{slug[:48]}-{uid[:8]}"),
        licence=licence,
        hints=AttributeHints(category=None if category is None else slug),
    )
