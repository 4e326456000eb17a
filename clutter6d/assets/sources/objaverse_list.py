"""A curated list of Objaverse's objects: all that is needed to attribute, process and freeze them, in one CSV."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from clutter6d.assets.asset import LARGE_EXTENT_M, Licence, SizeClass
from clutter6d.assets.shape_preparation import draw_tabletop_size
from clutter6d.assets.slug import slugify
from clutter6d.assets.sources.base import AttributeHints, SourceObject
from clutter6d.assets.sources.objaverse_annotation import LICENCES, UID, Annotation
from clutter6d.errors import InvalidFileError
from clutter6d.schema import read_bytes, write_bytes

MAX_LIST_BYTES = 64 << 20
_TEXT = Field("", max_length=1000)


class ListedObject(BaseModel):
    """One object of a curated list.

    Attributes:
        uid: Its identity in Objaverse 1.0.
        category: LVIS category.
        licence: SPDX name of its licence.
        author: Whom an attribution names.
        url: Where it was published.
        title: As its author calls it.
        vertices: As stated before the download; 0 if not.
        faces: Likewise.
        glb_bytes: Likewise.
        size_class: Size cohort that it will be processed to.
        longest_cm: Length of its longest side then.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    uid: str = Field(pattern=UID)
    category: str = _TEXT
    licence: str = Field(max_length=50)
    author: str = _TEXT
    url: str = _TEXT
    title: str = _TEXT
    vertices: int = 0
    faces: int = 0
    glb_bytes: int = 0
    size_class: SizeClass | None = None
    longest_cm: float = 0.0

    @classmethod
    def of(cls, category: str | None, annotation: Annotation) -> "ListedObject":
        """An object by its annotation, with the size that processing will draw for it."""
        listed = cls(
            uid=annotation.uid,
            category=(category or "")[:1000],
            licence=LICENCES[annotation.license or ""],
            author=annotation.author[:1000],
            url=annotation.viewer_url[:1000],
            title=annotation.name[:1000],
            vertices=annotation.vertices,
            faces=annotation.faces,
            glb_bytes=annotation.glb.size or 0,
        )
        longest_m = draw_tabletop_size(listed.as_source_object(), seed=0)
        size_class: SizeClass = "large" if longest_m >= LARGE_EXTENT_M[0] else "small"
        return listed.model_copy(update={"size_class": size_class, "longest_cm": round(100 * longest_m, 2)})

    def as_source_object(self) -> SourceObject:
        """As an asset source lists it; its unit is unknown."""
        slug = slugify(self.category or self.title)
        return SourceObject(
            key=self.uid,
            name=slugify(f"{slug[:48]}-{self.uid[:8]}"),
            licence=Licence(
                name=self.licence, author=self.author, source="objaverse", source_id=self.uid, url=self.url
            ),
            hints=AttributeHints(category=slug if self.category else None),
            is_metric=False,
        )


def write_list(path: Path, objects: Sequence[ListedObject]) -> None:
    """Write a curated list.

    Raises:
        StorageError: It cannot be written.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(ListedObject.model_fields), lineterminator="\n")
    writer.writeheader()
    writer.writerows(item.model_dump() for item in objects)
    write_bytes(path, text.getvalue().encode())


def read_list(path: Path) -> tuple[ListedObject, ...]:
    """Read a curated list; columns may be left out or added, but for ``uid`` and ``licence``.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is no such list, or an object stands in it twice.
    """
    content = read_bytes(path, what="curated list", max_bytes=MAX_LIST_BYTES)
    try:
        rows = list(csv.DictReader(io.StringIO(content.decode("utf-8-sig"))))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InvalidFileError(path, f"not a CSV file ({error})") from None
    known = ListedObject.model_fields
    return check_list(({key: row[key] for key in row if key in known and row[key]} for row in rows), path)


def check_list(rows: Iterable[Mapping[str, Any]], where: Path | str) -> tuple[ListedObject, ...]:
    """Objects from plain values.

    Raises:
        InvalidFileError: A value is not what it should be, an object stands there twice, or there is none.
    """
    found: dict[str, ListedObject] = {}
    for number, row in enumerate(rows, start=1):
        try:
            listed = ListedObject.model_validate(row)
        except ValidationError as error:
            first = error.errors()[0]
            column = ".".join(str(part) for part in first["loc"])
            raise InvalidFileError(where, f"object {number}, column '{column}': {first['msg']}") from None
        if listed.uid in found:
            raise InvalidFileError(where, f"object {number}: {listed.uid} is there twice")
        found[listed.uid] = listed
    if not found:
        raise InvalidFileError(
            where, "lists no objects; make it with: clutter6d assets curate objaverse --out LIST.csv"
        )
    return tuple(found.values())
