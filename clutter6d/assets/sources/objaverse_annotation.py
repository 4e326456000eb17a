"""What is used of Objaverse's annotations, and of the package that downloads them."""

import contextlib
import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any, Protocol, runtime_checkable

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from clutter6d.assets.mesh_io import MeshLimits
from clutter6d.errors import InvalidValueError, StorageError

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

UID = r"^[0-9a-f]{32}$"
"""Every object's identity."""

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
    face_count: int | None = Field(None, alias="faceCount")


class Annotation(_Record):
    """What is used of one object's annotation; everything else that Objaverse states is ignored."""

    uid: str = Field(pattern=UID)
    name: str = ""
    license: str | None = None
    viewer_url: str = Field("", alias="viewerUrl")
    user: _User = _User.model_validate({})
    vertex_count: int | None = Field(None, alias="vertexCount")
    face_count: int | None = Field(None, alias="faceCount")
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

    @property
    def vertices(self) -> int:
        """The larger of the two counts that are stated, 0 if none is."""
        return max(self.vertex_count or 0, self.glb.vertex_count or 0)

    @property
    def faces(self) -> int:
        """The larger of the two counts that are stated, 0 if none is."""
        return max(self.face_count or 0, self.glb.face_count or 0)

    def refusal(self, licences: Sequence[str], limits: MeshLimits) -> str | None:
        """Why the object is not even downloaded; a size that is not stated is judged after the download."""
        if self.license not in licences:
            return "licence"
        if self.license != "cc0" and not self.author:
            return "no-author"
        if self.is_age_restricted:
            return "age-restricted"
        if self.vertices > limits.max_vertices:
            return "too-many-vertices"
        if (self.glb.size or 0) > limits.max_bytes:
            return "too-large"
        return None


def parse_annotation(record: object) -> Annotation | None:
    """An annotation as downloaded; ``None`` if it is missing or malformed."""
    try:
        return Annotation.model_validate(record)
    except ValidationError:
        return None


@contextmanager
def annotations_online() -> Iterator[None]:
    """Keep the package quiet, and tell in one line what went wrong.

    Raises:
        StorageError: The annotations could not be downloaded, or what was downloaded is damaged.
        InvalidValueError: An object is asked for that is not in Objaverse 1.0.
    """
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            yield
    except (OSError, EOFError, ValueError) as error:
        advice = "try again online; if it stays so, remove the folder .objaverse in your home"
        raise StorageError(f"Objaverse's annotations could not be downloaded ({error}); {advice}") from None
    except KeyError as error:
        raise InvalidValueError(f"{error.args[0]} is not in Objaverse 1.0") from None
