"""Small meshes and mesh files, good and bad, that the tests make for themselves."""

import io
import json
import struct
import zipfile
from pathlib import Path

import numpy as np
import trimesh

from clutter6d.assets.asset import Licence, Mesh, VisualMesh
from clutter6d.assets.sources.base import AttributeHints, RawShape, SourceObject

GREY = (0.5, 0.5, 0.5, 1.0)


def as_mesh(mesh: trimesh.Trimesh) -> Mesh:
    return Mesh(vertices=np.array(mesh.vertices, dtype=np.float32), faces=np.array(mesh.faces, dtype=np.int32))


def as_shape(*meshes: trimesh.Trimesh) -> RawShape:
    return RawShape(visual=tuple(VisualMesh(mesh=as_mesh(mesh), rgba=GREY) for mesh in meshes))


def arrays(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    return np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)


def source_object(name: str = "thing", **changes: object) -> SourceObject:
    licence = Licence(name="CC0-1.0", author="a tester", source="test", source_id=name)
    return SourceObject(**{"key": name, "name": name, "licence": licence, "hints": AttributeHints()} | changes)


def open_can() -> trimesh.Trimesh:
    """A cylinder's mantle and bottom: a single sheet without thickness."""
    can = trimesh.creation.cylinder(0.04, 0.1, sections=24)
    return trimesh.Trimesh(can.vertices, can.faces[can.face_normals[:, 2] < 0.9], process=False)


def l_bracket() -> trimesh.Trimesh:
    long = trimesh.creation.box((0.10, 0.03, 0.02))
    short = trimesh.creation.box((0.02, 0.03, 0.05)).apply_translation((0.04, 0, 0.035))
    return trimesh.boolean.union([long, short])


def obj_text(mesh: trimesh.Trimesh) -> bytes:
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices]
    return "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces)]).encode() + b"\n"


def huge_ply_header() -> bytes:
    return (
        b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
        b"property float z\nelement face 4000000000\nproperty list uchar int vertex_indices\nend_header\n" + b"\0" * 64
    )


def huge_glb() -> bytes:
    header = {
        "asset": {"version": "2.0"},
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"componentType": 5126, "count": 2_000_000_000, "type": "VEC3"}],
    }
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sII", b"glTF", 2, 20 + len(text)) + struct.pack("<I4s", len(text), b"JSON") + text


def truncated_stl() -> bytes:
    return trimesh.creation.box((1, 1, 1)).export(file_type="stl")[:300]


def catalogue(folder: Path, models: dict[str, tuple[str, bytes]], *, stem: str = "Test") -> Path:
    """A package of one catalogue: models by id, each with the properties' lines and the OBJ file."""
    share = folder / "share"
    path = share / "sweethome3d" / "furniture" / f"{stem}.sh3f"
    path.parent.mkdir(parents=True)
    copyright_file = share / "doc" / "sweethome3d-furniture" / "copyright"
    copyright_file.parent.mkdir(parents=True)
    copyright_file.write_text(f"Format: x\n\nFiles: {stem}/*\nCopyright: 2020, somebody\nLicense: CC-BY-3.0\n")
    listing = io.StringIO()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for number, (key, (lines, content)) in enumerate(models.items(), start=1):
            listing.write(f"id#{number}={key}\nmodel#{number}=/test/m{number}/m{number}.obj\n")
            listing.write("".join(f"{line.replace('=', f'#{number}=', 1)}\n" for line in lines.splitlines()))
            archive.writestr(f"test/m{number}/m{number}.obj", content)
        archive.writestr("PluginFurnitureCatalog.properties", listing.getvalue().encode("latin-1"))
    return path.parent
