"""Reading mesh files with suspicion: limits before parsing, every failure a rejection with a reason."""

import io
import json
import logging
import re
import struct
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import trimesh
from jaxtyping import Float, Int
from trimesh.resolvers import Resolver

from clutter6d.assets.asset import Mesh, VisualMesh
from clutter6d.assets.collada import count_collada_vertices
from clutter6d.assets.mesh_colour import face_colours, quantise_colours
from clutter6d.assets.sources.base import RawShape
from clutter6d.errors import MeshRejectedError, MissingFileError

logging.getLogger("trimesh").addHandler(logging.NullHandler())  # what it finds in bad files stays off the terminal

MESH_SUFFIXES = (".obj", ".glb", ".gltf", ".stl", ".ply", ".dae")
UpAxis = Literal["y", "z"]
DEFAULT_UP: dict[str, UpAxis] = {"obj": "y", "glb": "y", "gltf": "y", "stl": "z", "ply": "z", "dae": "z"}


@dataclass(frozen=True, kw_only=True, slots=True)
class MeshLimits:
    """Largest mesh that is read (paper, "Object Selection and Geometry Filtering").

    Attributes:
        max_vertices: Vertices, as the file counts them.
        max_bytes: Size of the mesh file.
        max_companion_bytes: Size of all its materials and textures together.
    """

    max_vertices: int = 50_000
    max_bytes: int = 5_000_000
    max_companion_bytes: int = 200_000_000


class _Companions(Resolver):
    """Materials, buffers and textures by file name alone: from memory, or from one folder and nowhere else."""

    def __init__(self, files: Mapping[str, bytes], folder: Path | None, limits: MeshLimits) -> None:
        self._files = {_base_name(name): content for name, content in files.items()}
        self._folder, self._bytes_left = folder, limits.max_companion_bytes

    def get(self, key: str) -> bytes:
        name = _base_name(key)
        if name not in self._files and self._folder is not None:
            path = next((file for file in self._folder.iterdir() if file.name.lower() == name and file.is_file()), None)
            if path is None:
                raise FileNotFoundError(f"'{name}' is not beside it")
            self._bytes_left -= path.stat().st_size
            if self._bytes_left < 0:
                raise MeshRejectedError("too-large", "its materials and textures are larger than is read")
            self._files[name] = path.read_bytes()
        return _as_utf8(self._files[name]) if name.endswith(".mtl") else self._files[name]

    def keys(self) -> Any:
        return self._files.keys()

    def write(self, name: str, data: bytes) -> None:
        raise OSError(f"cannot write {name}: companions are only read ({len(data)} bytes)")

    def namespaced(self, namespace: str) -> "_Companions":  # noqa: ARG002  names are flat here
        return self


def read_mesh_file(path: Path, *, up: UpAxis | None = None, limits: MeshLimits | None = None) -> RawShape:
    """Read one OBJ, GLB, glTF, STL, PLY or DAE file; materials and textures are looked for beside it.

    Args:
        path: The file.
        up: Its vertical axis; by default y for OBJ and glTF, z for the others.
        limits: Largest mesh that is read.

    Raises:
        MissingFileError: There is no such file.
        MeshRejectedError: It is too large, unreadable, empty, or holds numbers that are not finite.
    """
    limits = limits or MeshLimits()
    if not path.is_file():
        raise MissingFileError("mesh file", path)
    try:
        size = path.stat().st_size
        if size > limits.max_bytes:
            raise MeshRejectedError("too-large", f"{size:,} bytes; at most {limits.max_bytes:,} are read")
        content = path.read_bytes()
    except OSError as error:
        raise MeshRejectedError("unreadable", f"the file cannot be read: {error.strerror}") from None
    return _read(content, path.suffix[1:].lower(), _Companions({}, path.parent, limits), up, limits)


def read_mesh(
    content: bytes,
    file_type: str,
    *,
    companions: Mapping[str, bytes] | None = None,
    up: UpAxis | None = None,
    limits: MeshLimits | None = None,
) -> RawShape:
    """Read a mesh from memory; see ``read_mesh_file``.

    Args:
        content: The mesh file.
        file_type: Its suffix without the dot.
        companions: Materials, buffers and textures by file name.
        up: Its vertical axis.
        limits: Largest mesh that is read.
    """
    limits = limits or MeshLimits()
    return _read(content, file_type, _Companions(companions or {}, None, limits), up, limits)


def _read(content: bytes, file_type: str, companions: _Companions, up: UpAxis | None, limits: MeshLimits) -> RawShape:
    if len(content) > limits.max_bytes:
        raise MeshRejectedError("too-large", f"{len(content):,} bytes; at most {limits.max_bytes:,} are read")
    if not content.strip():
        raise MeshRejectedError("empty", "the file is empty")
    _check_vertex_count(_declared_vertices(content, file_type), limits)
    vertices, faces, colours = _parse(content, file_type, companions, limits)
    if (up or DEFAULT_UP.get(file_type)) == "y":
        vertices = vertices @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    return RawShape(visual=group_by_colour(vertices, faces, colours))


def group_by_colour(
    vertices: Float[np.ndarray, "vertex 3"], faces: Int[np.ndarray, "face 3"], colours: Float[np.ndarray, "face 4"]
) -> tuple[VisualMesh, ...]:
    """One mesh for each of at most 8 colours."""
    palette, labels = quantise_colours(colours)
    result: list[VisualMesh] = []
    for label, colour in enumerate(palette):
        chosen = faces[labels == label]
        used, renumbered = np.unique(chosen, return_inverse=True)
        mesh = Mesh(vertices=vertices[used].astype(np.float32), faces=renumbered.reshape(-1, 3).astype(np.int32))
        red, green, blue, alpha = (float(value) for value in colour)
        result.append(VisualMesh(mesh=mesh, rgba=(red, green, blue, alpha)))
    return tuple(result)


def _as_utf8(text: bytes) -> bytes:
    """Text in UTF-8 as it is, other text as if it were Latin-1; trimesh's guess depends on what else is installed."""
    try:
        text.decode()
    except UnicodeDecodeError:
        return text.decode("latin-1").encode()
    return text


def _parse(
    content: bytes, file_type: str, companions: _Companions, limits: MeshLimits
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All triangles of a file, in one frame, with a colour each."""
    if f".{file_type}" not in MESH_SUFFIXES:
        raise MeshRejectedError("unreadable", f"'.{file_type}' is none of {', '.join(MESH_SUFFIXES)}")
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            source = io.BytesIO(_as_utf8(content) if file_type == "obj" else content)
            scene = trimesh.load_scene(source, file_type=file_type, resolver=companions, process=False)
            placed = [(scene.graph.get(node)) for node in scene.graph.nodes_geometry]
            meshes = [(scene.geometry[name], matrix) for matrix, name in placed if name is not None]
            meshes = [(mesh, matrix) for mesh, matrix in meshes if isinstance(mesh, trimesh.Trimesh)]
            _check_vertex_count(sum(len(mesh.vertices) for mesh, _ in meshes) // _DUPLICATION[file_type], limits)
            blocks = [_block(mesh, matrix) for mesh, matrix in meshes if len(mesh.faces)]
    except (MeshRejectedError, MemoryError):
        raise
    except Exception as error:  # noqa: BLE001  parsers raise anything on broken input
        detail = f"{type(error).__name__}: {error}".splitlines()[0][:200]
        raise MeshRejectedError("unreadable", f"not a valid {file_type} file ({detail})") from None
    if not blocks:
        raise MeshRejectedError("empty", "the file holds no triangle")
    starts = np.cumsum([0, *(len(block[0]) for block in blocks)])[:-1]
    vertices = np.concatenate([block[0] for block in blocks])
    faces = np.concatenate([block[1] + start for block, start in zip(blocks, starts, strict=True)])
    with np.errstate(over="ignore"):
        if not np.isfinite(vertices[faces].astype(np.float32)).all():
            raise MeshRejectedError("not-finite", "some vertices are NaN or infinite")
    return vertices, faces, np.concatenate([block[2] for block in blocks])


_DUPLICATION = {"stl": 6, "obj": 4, "glb": 1, "gltf": 1, "ply": 1, "dae": 4}
"""How many times a parser may repeat a vertex, at corners, colour borders and texture seams."""


def _block(mesh: trimesh.Trimesh, matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    vertices = np.asarray(mesh.vertices, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    faces = np.asarray(mesh.faces, dtype=np.int64)
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise MeshRejectedError("unreadable", "a face names a vertex that is not there")
    return vertices, faces if np.linalg.det(matrix[:3, :3]) >= 0 else faces[:, ::-1], face_colours(mesh)


def _check_vertex_count(count: int, limits: MeshLimits) -> None:
    if count > limits.max_vertices:
        raise MeshRejectedError("too-many-vertices", f"{count:,} vertices; at most {limits.max_vertices:,} are read")


def _declared_vertices(content: bytes, file_type: str) -> int:
    """How many vertices a file says it has, from its text or header alone; 0 where that cannot be told."""
    if file_type == "obj":
        return len(re.findall(rb"^\s*v\s", content, flags=re.MULTILINE))
    if file_type == "ply":
        found = re.search(rb"element\s+vertex\s+(\d+)", content[:4096])
        return int(found[1]) if found else 0
    if file_type == "stl" and not content.lstrip().startswith(b"solid") and len(content) >= 84:
        declared = struct.unpack_from("<I", content, 80)[0]
        if 84 + 50 * declared > len(content):
            raise MeshRejectedError("unreadable", f"truncated: {declared:,} triangles declared, fewer are there")
        return declared // 2
    if file_type in ("glb", "gltf"):
        return _gltf_vertices(content, file_type)
    return count_collada_vertices(content) if file_type == "dae" else 0


def _gltf_vertices(content: bytes, file_type: str) -> int:
    try:
        length = struct.unpack_from("<I", content, 12)[0] if file_type == "glb" else len(content)
        header = json.loads(content[20 : 20 + length] if file_type == "glb" else content)
        primitives = [item for mesh in header.get("meshes", []) for item in mesh["primitives"]]
        used = {item["attributes"]["POSITION"] for item in primitives}
        return sum(int(header["accessors"][index]["count"]) for index in used)
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, struct.error, RecursionError) as error:
        raise MeshRejectedError("unreadable", f"not a valid {file_type} file ({type(error).__name__})") from None


def _base_name(name: str) -> str:
    return name.replace("\\", "/").rsplit("/", 1)[-1].strip().lower()
