"""The 1,000 random compound objects of ``pybullet_data/random_urdfs``, from the installed package or from its wheel.

Each object is an OBJ mesh, z up, and a URDF that states its scale, mass and colour.
"""

import hashlib
import importlib.util
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np
from lxml import etree

from clutter6d.assets.asset import Licence, Mesh, VisualMesh
from clutter6d.assets.mesh_io import MeshLimits, read_mesh
from clutter6d.assets.sources.base import AttributeHints, RawShape, SourceObject
from clutter6d.errors import (
    InvalidFileError,
    InvalidValueError,
    MeshRejectedError,
    MissingDependencyError,
    MissingFileError,
)

COUNT = 1000
MAX_URDF_BYTES = 64 << 10
_LOADER_VERSION = "1"
_FOLDER = "pybullet_data/random_urdfs/"
_URL = "https://github.com/bulletphysics/bullet3/tree/master/examples/pybullet/gym/pybullet_data/random_urdfs"


@dataclass(frozen=True, kw_only=True, slots=True)
class Urdf:
    """What the URDF of one rigid object states."""

    mesh_file: str
    scale: tuple[float, float, float]
    mass_kg: float
    rgba: tuple[float, float, float, float]


class RandomUrdfsSource:
    """Random compound objects, 6 to 15 cm long.

    Args:
        path: The ``random_urdfs`` folder, or a wheel of ``pybullet``; by default the installed ``pybullet_data``.
        count: How many of the 1,000 objects, from the first; all by default.
        limits: Largest mesh that is read.

    Raises:
        MissingDependencyError: No path is given and ``pybullet_data`` is not installed.
        MissingFileError: There is nothing at the path.
        InvalidValueError: The count is not between 0 and 1,000.
    """

    name = "random_urdfs"

    def __init__(self, path: Path | None = None, *, count: int = COUNT, limits: MeshLimits | None = None) -> None:
        if not 0 <= count <= COUNT:
            raise InvalidValueError(f"random_urdfs: count is {count}; it must be between 0 and {COUNT}")
        self._path = path or _installed_folder()
        if not self._path.exists():
            raise MissingFileError("random_urdfs folder or pybullet wheel", self._path)
        self._count = count
        self._limits = limits or MeshLimits()

    def objects(self) -> Sequence[SourceObject]:
        """The objects whose URDF is there, by number.

        Raises:
            InvalidFileError: The path holds none of them, or a URDF is not what it should be.
        """
        keys = [key for key in (f"{i:03d}" for i in range(self._count)) if self._file(key, f"{key}.urdf").is_file()]
        if self._count and not keys:
            raise InvalidFileError(self._path, f"holds no random URDFs (expected {_FOLDER}000/000.urdf)")
        return tuple(self._listed(key) for key in keys)

    def fingerprint(self, item: SourceObject) -> str:
        """Hash of the URDF, the mesh and the limits."""
        digest = hashlib.sha256(repr((_LOADER_VERSION, item.key, self._limits)).encode())
        urdf = self._urdf(item.key)
        digest.update(repr(urdf).encode())
        digest.update(self._file(item.key, urdf.mesh_file).read_bytes())
        return digest.hexdigest()

    def load(self, item: SourceObject) -> RawShape:
        """The mesh in metres, in the URDF's colour.

        Raises:
            MeshRejectedError: The mesh cannot be used; that of object 168 holds vertices that are not numbers.
        """
        urdf = self._urdf(item.key)
        file = self._file(item.key, urdf.mesh_file)
        if not file.is_file():
            raise MeshRejectedError("unreadable", f"{urdf.mesh_file} is not beside its URDF")
        shape = read_mesh(file.read_bytes(), "obj", up="z", limits=self._limits)
        scale = np.array(urdf.scale)
        scaled = [
            Mesh(vertices=(part.mesh.vertices * scale).astype(np.float32), faces=part.mesh.faces)
            for part in shape.visual
        ]
        return RawShape(visual=tuple(VisualMesh(mesh=mesh, rgba=urdf.rgba) for mesh in scaled))

    def _listed(self, key: str) -> SourceObject:
        licence = Licence(
            name="Zlib",
            author="The Bullet Physics developers",
            source="pybullet_data/random_urdfs",
            source_id=key,
            url=_URL,
        )
        hints = AttributeHints(category="compound", mass_kg=self._urdf(key).mass_kg)
        return SourceObject(key=key, name=f"compound-{key}", licence=licence, hints=hints)

    def _urdf(self, key: str) -> Urdf:
        file = self._file(key, f"{key}.urdf")
        with file.open("rb") as stream:
            content = stream.read(MAX_URDF_BYTES + 1)
        return parse_urdf(content, where=f"{self._path}: {key}.urdf")

    def _file(self, key: str, name: str) -> Traversable:
        return _root(self._path) / key / name


def parse_urdf(content: bytes, *, where: str) -> Urdf:
    """Read the URDF of one rigid object; entities and document types are not followed.

    Args:
        content: The file.
        where: Which file, for messages.

    Raises:
        InvalidFileError: It is too large, not XML, has a document type, or lacks mesh, scale or mass.
    """
    if len(content) > MAX_URDF_BYTES:
        raise InvalidFileError(where, f"more than {MAX_URDF_BYTES:,} bytes are too many for a URDF")
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False)
    try:
        root = etree.fromstring(content, parser)
    except etree.XMLSyntaxError as error:
        raise InvalidFileError(where, f"not XML: {error.msg}") from None
    if root.getroottree().docinfo.doctype:
        raise InvalidFileError(where, "has a document type, which a URDF does not need")
    if root.tag != "robot" or len(root.findall("link")) != 1:
        raise InvalidFileError(where, "not the URDF of one rigid object: expected <robot> with one <link>")
    mesh_file = _attribute(root, "link/visual/geometry/mesh", "filename", where)
    if mesh_file != Path(mesh_file).name or not mesh_file.endswith(".obj"):
        raise InvalidFileError(where, f"mesh '{mesh_file}' is not an OBJ file beside the URDF")
    sx, sy, sz = _numbers(root, "link/visual/geometry/mesh", "scale", 3, where)
    (mass_kg,) = _numbers(root, "link/inertial/mass", "value", 1, where)
    red, green, blue, alpha = _numbers(root, "link/visual/material/color", "rgba", 4, where)
    if min(sx, sy, sz, mass_kg) <= 0 or not all(0 <= value <= 1 for value in (red, green, blue, alpha)):
        raise InvalidFileError(where, "scale and mass must be positive, and the colour within [0, 1]")
    return Urdf(mesh_file=mesh_file, scale=(sx, sy, sz), mass_kg=mass_kg, rgba=(red, green, blue, alpha))


def _attribute(root: etree._Element, path: str, name: str, where: str) -> str:
    element = root.find(path)
    value = None if element is None else element.get(name)
    if value is None:
        raise InvalidFileError(where, f"lacks the attribute '{name}' of <{path}>")
    return value


def _numbers(root: etree._Element, path: str, name: str, count: int, where: str) -> list[float]:
    text = _attribute(root, path, name, where)
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != count or not np.isfinite(values).all():
        raise InvalidFileError(where, f"'{name}' of <{path}> is '{text[:40]}', expected {count} finite numbers")
    return values


@cache
def _root(path: Path) -> Traversable:
    if path.is_dir():
        return path
    try:
        return zipfile.Path(path, _FOLDER)
    except (zipfile.BadZipFile, OSError) as error:
        raise InvalidFileError(path, f"neither a folder nor a wheel ({error})") from None


def _installed_folder() -> Path:
    found = importlib.util.find_spec("pybullet_data")
    if found is None or not found.submodule_search_locations:
        raise MissingDependencyError(
            "random_urdfs needs the package 'pybullet': pip install 'clutter6d[sources]', or give the path of its wheel"
        )
    return Path(next(iter(found.submodule_search_locations))) / "random_urdfs"
