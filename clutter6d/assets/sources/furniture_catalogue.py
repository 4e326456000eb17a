"""The Debian package ``sweethome3d-furniture``: household objects with names, real sizes, creators and licences.

A catalogue (``.sh3f``) is a zip of OBJ models and one properties file. The package's copyright file states the licence
of each catalogue; it travels with every object.
"""

import hashlib
import math
import os
import re
import zipfile
import zlib
from collections import defaultdict
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path, PurePosixPath

import numpy as np

from clutter6d.assets.asset import Licence, Mesh, VisualMesh
from clutter6d.assets.mesh_io import MeshLimits, read_mesh
from clutter6d.assets.slug import slugify
from clutter6d.assets.sources.base import AttributeHints, RawShape, SourceObject
from clutter6d.errors import InvalidFileError, InvalidValueError, MeshRejectedError, MissingFileError

FOLDER_VARIABLE = "CLUTTER6D_FURNITURE_CATALOGUE"
DEFAULT_FOLDERS = (Path("/usr/share/sweethome3d/furniture"), Path("/usr/local/share/sweethome3d/furniture"))
MAX_SIDE_M = 0.60
_LISTING = "PluginFurnitureCatalog.properties"
_MAX_LISTING_BYTES = 4 << 20
_LOADER_VERSION = "1"
_SPDX = {"CC0": "CC0-1.0", "CC-BY-3.0-USA": "CC-BY-3.0-US"}
_ZIP_ERRORS = (zipfile.BadZipFile, zlib.error, EOFError, OSError, NotImplementedError, RuntimeError)
"""What reading a damaged zip raises; the last two for unknown methods and for passwords."""
_COPYRIGHT_FIELD = re.compile(r"^(Files|Copyright|License):[ \t]*(.*)$", flags=re.MULTILINE)
_ENTRY = re.compile(r"^([A-Za-z]+)#(\d+)\s*=\s*(.*)$")


class FurnitureCatalogueSource:
    """All objects of the catalogues whose every side is at most ``max_side_m``.

    Args:
        folder: Where the ``.sh3f`` files lie; default the variable ``CLUTTER6D_FURNITURE_CATALOGUE``, then where the
            Debian package installs them.
        max_side_m: Longest side allowed.
        limits: Largest mesh that is read.
        excluded: Keys of objects that are left out, each with the reason.
    """

    name = "furniture_catalogue"

    def __init__(
        self,
        folder: Path | None = None,
        *,
        max_side_m: float = MAX_SIDE_M,
        limits: MeshLimits | None = None,
        excluded: Mapping[str, str] | None = None,
    ) -> None:
        if max_side_m <= 0:
            raise InvalidValueError(f"max_side_m is {max_side_m}; it must be positive")
        self._folder = folder or _default_folder()
        self._max_side_m = max_side_m
        self._limits, self._excluded = limits or MeshLimits(), frozenset(excluded or ())
        if not any(self._folder.glob("*.sh3f")):
            hint = f"install it with: apt-get install sweethome3d-furniture; or set {FOLDER_VARIABLE} to its folder"
            raise MissingFileError("furniture catalogue", self._folder, hint)

    def objects(self) -> Sequence[SourceObject]:
        """All objects within the size limit that are not excluded, by catalogue and number."""
        return tuple(item for item, _, _ in self._listing.values() if item.key not in self._excluded)

    def fingerprint(self, item: SourceObject) -> str:
        """Hash of the model's files (by the archive's own checksums), its size and its rotation."""
        _, catalogue, entry = self._listing[item.key]
        folder = str(PurePosixPath(entry["model"].lstrip("/")).parent) + "/"
        with zipfile.ZipFile(catalogue) as archive:
            members = sorted(
                (m.filename, m.CRC, m.file_size) for m in archive.infolist() if m.filename.startswith(folder)
            )
        content = (_LOADER_VERSION, item.key, item.extents_m, entry.get("modelRotation"), self._limits, members)
        return hashlib.sha256(repr(content).encode()).hexdigest()

    def load(self, item: SourceObject) -> RawShape:
        """Read the model, turned as the catalogue shows it, z up, in the file's own unit.

        Raises:
            MeshRejectedError: The model is too large or cannot be read.
        """
        _, catalogue, entry = self._listing[item.key]
        model = PurePosixPath(entry["model"].lstrip("/"))
        with zipfile.ZipFile(catalogue) as archive:
            try:
                size = archive.getinfo(str(model)).file_size
            except KeyError:
                raise MeshRejectedError("unreadable", f"{model} is not in {catalogue.name}") from None
            if size > self._limits.max_bytes:
                raise MeshRejectedError("too-large", f"{size:,} bytes; at most {self._limits.max_bytes:,} are read")
            companions = self._companions(archive, str(model.parent) + "/")
            content = archive.read(str(model))
        shape = read_mesh(content, model.suffix[1:].lower(), companions=companions, up="z", limits=self._limits)
        return RawShape(visual=tuple(_turn(part, _turn_to_z_up(entry)) for part in shape.visual))

    def _companions(self, archive: zipfile.ZipFile, folder: str) -> dict[str, bytes]:
        members = [m for m in archive.infolist() if m.filename.startswith(folder) and not m.is_dir()]
        members = [m for m in members if not m.filename.lower().endswith((".obj", ".txt"))]
        if sum(member.file_size for member in members) > self._limits.max_companion_bytes:
            raise MeshRejectedError("too-large", "its textures unpack to more than is read")
        return {member.filename: archive.read(member) for member in members}

    @cached_property
    def _listing(self) -> dict[str, tuple[SourceObject, Path, dict[str, str]]]:
        licences = _read_licences(self._folder)
        result: dict[str, tuple[SourceObject, Path, dict[str, str]]] = {}
        counts: dict[str, int] = defaultdict(int)
        for catalogue in sorted(self._folder.glob("*.sh3f")):
            licence, holder = licences.get(catalogue.stem, ("unknown", ""))
            for entry in _read_entries(catalogue):
                sides = _sides_m(catalogue, entry)
                if max(sides) > self._max_side_m:
                    continue
                slug = slugify(entry["name"])
                counts[slug] += 1
                item = SourceObject(
                    key=entry["id"],
                    name=slug if counts[slug] == 1 else f"{slug}-{counts[slug]}",
                    licence=Licence(
                        name=licence,
                        author=entry.get("creator") or holder,
                        source=f"sweethome3d-furniture/{catalogue.stem}",
                        source_id=entry["id"],
                        url="https://www.sweethome3d.com/freeModels.jsp",
                    ),
                    hints=AttributeHints(category=slug),
                    extents_m=sides,
                )
                result[item.key] = (item, catalogue, entry)
        return result


def _default_folder() -> Path:
    named = os.environ.get(FOLDER_VARIABLE)
    if named:
        return Path(named)
    return next((folder for folder in DEFAULT_FOLDERS if folder.is_dir()), DEFAULT_FOLDERS[0])


def _read_entries(catalogue: Path) -> list[dict[str, str]]:
    """The models that a catalogue lists, each as its properties."""
    try:
        with zipfile.ZipFile(catalogue) as archive:
            if archive.getinfo(_LISTING).file_size > _MAX_LISTING_BYTES:
                raise InvalidFileError(catalogue, f"{_LISTING} is larger than {_MAX_LISTING_BYTES:,} bytes")
            text = archive.read(_LISTING).decode("latin-1")
    except (*_ZIP_ERRORS, KeyError) as error:
        raise InvalidFileError(catalogue, f"not a furniture catalogue ({error})") from None
    entries: dict[int, dict[str, str]] = defaultdict(dict)
    for line in text.splitlines():
        found = _ENTRY.match(line.strip())
        if found:
            entries[int(found[2])][found[1]] = _unescape(found[3].strip())
    needed = {"id", "name", "model", "width", "depth", "height"}
    return [entries[number] for number in sorted(entries) if needed <= entries[number].keys()]


def _sides_m(catalogue: Path, entry: dict[str, str]) -> tuple[float, float, float]:
    """Width, depth and height, which the catalogue gives in centimetres."""

    def length_m(side: str) -> float:
        try:
            value = float(entry[side]) / 100
        except ValueError:
            value = math.nan
        if not 0 < value < math.inf:
            raise InvalidFileError(catalogue, f"{entry['id']}: {side} is '{entry[side]}', which is no length in cm")
        return value

    return (length_m("width"), length_m("depth"), length_m("height"))


def _unescape(value: str) -> str:
    return re.sub(r"\\u([0-9a-fA-F]{4})", lambda found: chr(int(found[1], 16)), value)


def _read_licences(folder: Path) -> dict[str, tuple[str, str]]:
    """Licence and copyright holder of each catalogue, from the package's machine-readable copyright file."""
    share = folder.parent.parent
    path = share / "doc" / "sweethome3d-furniture" / "copyright"
    if not path.is_file():
        return {}
    result: dict[str, tuple[str, str]] = {}
    for paragraph in path.read_text(encoding="utf-8", errors="replace").split("\n\n"):
        fields: dict[str, str] = dict(_COPYRIGHT_FIELD.findall(paragraph))
        if "Files" in fields and "License" in fields:
            licence = fields["License"].strip()
            result[fields["Files"].split("/")[0].strip()] = (_SPDX.get(licence, licence), fields.get("Copyright", ""))
    return result


def _turn_to_z_up(entry: dict[str, str]) -> np.ndarray:
    """The catalogue's own rotation (y up, front towards +z), then z up with the front towards -y."""
    to_z_up = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    values = entry.get("modelRotation", "").split()
    if len(values) != 9:
        return to_z_up
    return to_z_up @ np.array([float(value) for value in values]).reshape(3, 3)


def _turn(visual: VisualMesh, rotation: np.ndarray) -> VisualMesh:
    vertices = (visual.mesh.vertices.astype(np.float64) @ rotation.T).astype(np.float32)
    return VisualMesh(mesh=Mesh(vertices=vertices, faces=visual.mesh.faces), rgba=visual.rgba)
