"""Any folder of mesh files as an asset source; the user states unit, licence and author."""

import hashlib
from collections import Counter
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Literal, cast, get_args

from clutter6d.assets.asset import Licence, Mesh, VisualMesh
from clutter6d.assets.mesh_io import MESH_SUFFIXES, MeshLimits, UpAxis, read_mesh_file
from clutter6d.assets.slug import slugify
from clutter6d.assets.sources.base import AttributeHints, RawShape, SourceObject
from clutter6d.errors import InvalidValueError, MissingFileError, UnknownNameError

Unit = Literal["m", "cm", "mm", "auto"]
METRES_PER_UNIT = {"m": 1.0, "cm": 0.01, "mm": 0.001, "auto": 1.0}


class DirectorySource:
    """Every OBJ, GLB, glTF, STL, PLY and DAE file below a folder.

    Args:
        path: The folder, or one mesh file.
        unit: Unit of the files. ``auto`` takes it as unknown: each object gets a tabletop size drawn from its key.
        up: Vertical axis of the files; by default y for OBJ and glTF, z for the others.
        licence: The terms under which the user has the meshes.
        author: Who made them.
        limits: Largest mesh that is read.

    Raises:
        MissingFileError: The folder does not exist.
        InvalidValueError: It holds no mesh file.
        UnknownNameError: The unit is none of ``m``, ``cm``, ``mm``, ``auto``, or the axis neither ``y`` nor ``z``.
    """

    name = "directory"

    def __init__(
        self,
        path: Path,
        *,
        unit: str = "auto",
        up: str | None = None,
        licence: str = "unstated",
        author: str = "unstated",
        limits: MeshLimits | None = None,
    ) -> None:
        if unit not in METRES_PER_UNIT:
            raise UnknownNameError("unit", unit, get_args(Unit))
        if up is not None and up not in get_args(UpAxis):
            raise UnknownNameError("vertical axis", up, get_args(UpAxis))
        if not path.exists():
            raise MissingFileError("folder of meshes", path)
        self._root = path if path.is_dir() else path.parent
        self._single = None if path.is_dir() else path
        self._unit = cast(Unit, unit)
        self._up: UpAxis | None = cast(UpAxis | None, up)
        self._limits = limits or MeshLimits()
        self._licence, self._author = licence, author
        if not self._files:
            raise InvalidValueError(f"{path} holds no mesh file ({', '.join(MESH_SUFFIXES)})")

    def objects(self) -> Sequence[SourceObject]:
        """All mesh files, by path."""
        stems = {key: slugify(path.stem) for key, path in self._files.items()}
        counts = Counter(stems.values())
        return tuple(self._describe(key, stems[key] if counts[stems[key]] == 1 else slugify(key)) for key in stems)

    def fingerprint(self, item: SourceObject) -> str:
        """Hash of the file, of the material file of the same name, and of this source's options.

        A file that cannot be read has a fingerprint too; it is rejected when it is loaded.
        """
        path = self._files[item.key]
        options = (self._unit, self._up, self._licence, self._author, self._limits)
        digest = hashlib.sha256(repr((item.key, options)).encode())
        try:
            if path.stat().st_size <= self._limits.max_bytes:
                digest.update(path.read_bytes())
                material = path.with_suffix(".mtl")
                digest.update(material.read_bytes() if material.is_file() else b"")
            else:
                digest.update(str(path.stat().st_size).encode())
        except OSError as error:
            digest.update(f"cannot be read: {error.strerror}".encode())
        return digest.hexdigest()

    def load(self, item: SourceObject) -> RawShape:
        """Read the file, in metres unless the unit is unknown.

        Raises:
            MeshRejectedError: The file is too large or cannot be read.
        """
        shape = read_mesh_file(self._files[item.key], up=self._up, limits=self._limits)
        factor = METRES_PER_UNIT[self._unit]
        return shape if factor == 1 else RawShape(visual=tuple(_scaled(part, factor) for part in shape.visual))

    def _describe(self, key: str, slug: str) -> SourceObject:
        licence = Licence(name=self._licence, author=self._author, source=self.name, source_id=key)
        hints = AttributeHints(category=slug.rstrip("0123456789-") or "object")
        return SourceObject(key=key, name=slug, licence=licence, hints=hints, is_metric=self._unit != "auto")

    @cached_property
    def _files(self) -> dict[str, Path]:
        found = [self._single] if self._single else sorted(self._root.rglob("*"))
        meshes = [path for path in found if path.suffix.lower() in MESH_SUFFIXES and path.is_file()]
        return {path.relative_to(self._root).as_posix(): path for path in meshes}


def _scaled(visual: VisualMesh, factor: float) -> VisualMesh:
    return VisualMesh(mesh=Mesh(vertices=visual.mesh.vertices * factor, faces=visual.mesh.faces), rgba=visual.rgba)
