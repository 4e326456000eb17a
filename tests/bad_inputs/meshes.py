"""Broken meshes: what is wrong with each, its file, and why it is rejected, or that it is not."""

import base64
import gzip
import io
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.bad_inputs.boxes import CORNERS, FACES, ascii_stl, dae, glb, gltf, gltf_parts, obj, ply, stl

ACCEPTED = "accepted"


@dataclass(frozen=True, kw_only=True, slots=True)
class BrokenMesh:
    """One file.

    Attributes:
        name: What is wrong with it; the test's id.
        suffix: Of the file.
        content: What is in it; or a function that puts it at a path, for what is no ordinary file.
        reasons: Each reason for which it may be rejected; ``accepted`` if an asset may come of it.
    """

    name: str
    suffix: str
    content: bytes | Callable[[Path], object]
    reasons: tuple[str, ...]

    @property
    def key(self) -> str:
        """The file's name."""
        return self.name + self.suffix

    def put(self, folder: Path) -> None:
        """Make the file."""
        if callable(self.content):
            self.content(folder / self.key)
        else:
            (folder / self.key).write_bytes(self.content)


def half(content: bytes) -> bytes:
    return content[: len(content) // 2]


def moved(index: int, value: float) -> np.ndarray:
    corners = CORNERS.copy()
    corners[index] = value
    return corners


def with_face(*face: int) -> np.ndarray:
    return np.concatenate([FACES, [face]])


def changed_gltf(change: Callable[[dict], object], *, buffer: bytes | None = None) -> bytes:
    tree, content = gltf_parts()
    change(tree)
    return glb(tree, content if buffer is None else buffer)


def entity_bomb() -> bytes:
    entities = "".join(f'<!ENTITY e{level} "{f"&e{level - 1};" * 10}">' for level in range(1, 10))
    return dae(prologue=f'<!DOCTYPE COLLADA [<!ENTITY e0 "boom">{entities}]>', title="&e9;")


def node_bomb() -> bytes:
    """Two to the power of 40 boxes in four kilobytes."""
    levels = ['<node id="n0"><instance_geometry url="#box"/></node>']
    levels += [f'<node id="n{i}">{f"""<instance_node url="#n{i - 1}"/>""" * 2}</node>' for i in range(1, 41)]
    return dae(nodes='<instance_node url="#n40"/>', library_nodes=levels)


def pixel_bomb() -> bytes:
    """A texture of 60,000 x 60,000 pixels in some kilobytes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    side = 60_000
    packer = zlib.compressobj(9)
    row = bytes(1 + side // 8)
    data = b"".join(packer.compress(row * 100) for _ in range(side // 100)) + packer.flush()
    header = struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")
    tree, buffer = gltf_parts()
    tree["bufferViews"] += [{"buffer": 0, "byteOffset": len(buffer), "byteLength": len(png)}]
    tree["buffers"][0]["byteLength"] += len(png)
    tree["images"] = [{"bufferView": 2, "mimeType": "image/png"}]
    tree["textures"] = [{"source": 0}]
    tree["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    tree["meshes"][0]["primitives"][0]["material"] = 0
    return glb(tree, buffer + png)


def zip_bomb() -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("box.obj", bytes(64 << 20))
    return buffer.getvalue()


def loose_tetrahedra(count: int) -> bytes:
    tetrahedron = 0.002 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float64)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    places = 0.2 * np.random.default_rng(0).random((count, 3))
    vertices = (tetrahedron + places[:, None]).reshape(-1, 3)
    return ply(vertices, (faces + 4 * np.arange(count)[:, None, None]).reshape(-1, 3))


def huge_and_hollow(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(20 << 30)


SQUARE = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]])
UNREADABLE, EMPTY, NOT_FINITE = ("unreadable",), ("empty",), ("not-finite",)
NOTHING = ("empty", "unreadable")
FLAT = (ACCEPTED, "degenerate", "no-volume")

BROKEN_MESHES = (
    BrokenMesh(name="no-bytes", suffix=".obj", content=b"", reasons=EMPTY),
    BrokenMesh(name="only-blanks", suffix=".stl", content=b" \n\t\n", reasons=EMPTY),
    BrokenMesh(name="prose", suffix=".obj", content=b"Dear Sir, the mesh is attached.\n", reasons=NOTHING),
    BrokenMesh(name="truncated-obj", suffix=".obj", content=obj()[:100], reasons=NOTHING),
    BrokenMesh(name="truncated-glb", suffix=".glb", content=half(glb()), reasons=UNREADABLE),
    BrokenMesh(name="truncated-glb-header", suffix=".glb", content=glb()[:10], reasons=UNREADABLE),
    BrokenMesh(name="truncated-gltf", suffix=".gltf", content=half(gltf()), reasons=UNREADABLE),
    BrokenMesh(name="truncated-stl", suffix=".stl", content=half(stl()), reasons=UNREADABLE),
    BrokenMesh(name="truncated-text-stl", suffix=".stl", content=ascii_stl()[:200], reasons=NOTHING),
    BrokenMesh(name="truncated-ply", suffix=".ply", content=half(ply()), reasons=UNREADABLE),
    BrokenMesh(name="truncated-ply-header", suffix=".ply", content=ply()[:60], reasons=UNREADABLE),
    BrokenMesh(name="truncated-dae", suffix=".dae", content=half(dae()), reasons=UNREADABLE),
    BrokenMesh(name="stl-called-ply", suffix=".ply", content=stl(), reasons=UNREADABLE),
    BrokenMesh(name="glb-called-obj", suffix=".obj", content=glb(), reasons=NOTHING),
    BrokenMesh(name="obj-called-glb", suffix=".glb", content=obj(), reasons=UNREADABLE),
    BrokenMesh(name="obj-called-dae", suffix=".dae", content=obj(), reasons=UNREADABLE),
    BrokenMesh(name="gzip-called-obj", suffix=".obj", content=gzip.compress(bytes(64 << 20)), reasons=NOTHING),
    BrokenMesh(name="zip-bomb-called-glb", suffix=".glb", content=zip_bomb(), reasons=UNREADABLE),
    BrokenMesh(name="nan-vertex", suffix=".obj", content=obj(moved(0, np.nan)), reasons=NOT_FINITE),
    BrokenMesh(name="infinite-vertex", suffix=".stl", content=stl(moved(1, np.inf)), reasons=NOT_FINITE),
    BrokenMesh(name="nan-vertex-ply", suffix=".ply", content=ply(moved(2, np.nan)), reasons=NOT_FINITE),
    BrokenMesh(name="nan-vertex-glb", suffix=".glb", content=glb(*gltf_parts(moved(3, np.nan))), reasons=NOT_FINITE),
    BrokenMesh(name="nan-vertex-dae", suffix=".dae", content=dae(moved(4, np.nan)), reasons=NOT_FINITE),
    BrokenMesh(name="enormous-vertex", suffix=".obj", content=obj(moved(0, 1e300)), reasons=NOT_FINITE),
    BrokenMesh(name="index-out-of-range", suffix=".obj", content=obj(faces=with_face(0, 1, 99)), reasons=UNREADABLE),
    BrokenMesh(
        name="index-out-of-range-ply", suffix=".ply", content=ply(faces=with_face(0, 1, 99)), reasons=UNREADABLE
    ),
    BrokenMesh(name="negative-index-ply", suffix=".ply", content=ply(faces=with_face(0, 1, -5)), reasons=UNREADABLE),
    BrokenMesh(
        name="index-out-of-range-glb",
        suffix=".glb",
        content=glb(*gltf_parts(faces=with_face(0, 1, 99))),
        reasons=UNREADABLE,
    ),
    BrokenMesh(name="no-faces", suffix=".obj", content=obj(faces=FACES[:0]), reasons=NOTHING),
    BrokenMesh(name="no-faces-ply", suffix=".ply", content=ply(faces=FACES[:0]), reasons=NOTHING),
    BrokenMesh(name="no-triangles-stl", suffix=".stl", content=stl(faces=FACES[:0]), reasons=NOTHING),
    BrokenMesh(name="all-in-one-point", suffix=".obj", content=obj(np.zeros((8, 3))), reasons=("degenerate",)),
    BrokenMesh(
        name="all-on-one-line",
        suffix=".obj",
        content=obj(CORNERS * [1, 0, 0]),
        reasons=("degenerate",),
    ),
    BrokenMesh(name="one-triangle", suffix=".obj", content=obj(SQUARE[:3], np.array([[0, 1, 2]])), reasons=FLAT),
    BrokenMesh(
        name="plane-without-thickness",
        suffix=".obj",
        content=obj(SQUARE, np.array([[0, 1, 2], [0, 2, 3]])),
        reasons=FLAT,
    ),
    BrokenMesh(name="inside-out", suffix=".stl", content=stl(faces=FACES[:, ::-1]), reasons=(ACCEPTED,)),
    BrokenMesh(name="a-side-missing", suffix=".ply", content=ply(faces=FACES[2:]), reasons=(ACCEPTED,)),
    BrokenMesh(
        name="thousands-of-pieces", suffix=".ply", content=loose_tetrahedra(4000), reasons=(ACCEPTED, "timed-out")
    ),
    BrokenMesh(
        name="vertex-bomb", suffix=".obj", content=b"v 0 0 0\n" * 400_000 + b"f 1 2 3\n", reasons=("too-many-vertices",)
    ),
    BrokenMesh(name="twenty-gigabytes", suffix=".obj", content=huge_and_hollow, reasons=("too-large",)),
    BrokenMesh(
        name="ply-claims-billions-of-vertices",
        suffix=".ply",
        content=ply(vertex_count=4_000_000_000),
        reasons=("too-many-vertices",),
    ),
    BrokenMesh(
        name="ply-claims-billions-of-faces", suffix=".ply", content=ply(face_count=4_000_000_000), reasons=UNREADABLE
    ),
    BrokenMesh(name="stl-claims-billions", suffix=".stl", content=stl(count=2**32 - 1), reasons=UNREADABLE),
    BrokenMesh(name="stl-claims-less", suffix=".stl", content=stl(count=3), reasons=NOTHING),
    BrokenMesh(
        name="glb-claims-billions",
        suffix=".glb",
        content=changed_gltf(lambda tree: tree["accessors"][0].update(count=3_000_000_000)),
        reasons=("too-many-vertices",),
    ),
    BrokenMesh(
        name="glb-claims-billions-of-indices",
        suffix=".glb",
        content=changed_gltf(lambda tree: tree["accessors"][1].update(count=3_000_000_000)),
        reasons=UNREADABLE,
    ),
    BrokenMesh(name="dae-claims-billions", suffix=".dae", content=dae(count=3_000_000_000), reasons=(ACCEPTED,)),
    BrokenMesh(
        name="glb-buffer-outside-the-file",
        suffix=".glb",
        content=changed_gltf(lambda tree: tree["bufferViews"][1].update(byteOffset=10_000_000)),
        reasons=UNREADABLE,
    ),
    BrokenMesh(
        name="glb-negative-offset",
        suffix=".glb",
        content=changed_gltf(lambda tree: tree["bufferViews"][1].update(byteOffset=-40)),
        reasons=UNREADABLE,
    ),
    BrokenMesh(
        name="glb-nodes-in-a-circle",
        suffix=".glb",
        content=changed_gltf(lambda tree: tree.update(nodes=[{"children": [1]}, {"children": [0], "mesh": 0}])),
        reasons=NOTHING,
    ),
    BrokenMesh(
        name="glb-twenty-thousand-copies",
        suffix=".glb",
        content=changed_gltf(
            lambda tree: tree.update(nodes=[{"mesh": 0}] * 20_000, scenes=[{"nodes": list(range(20_000))}])
        ),
        reasons=("too-many-vertices",),
    ),
    BrokenMesh(
        name="glb-nested-too-deeply",
        suffix=".glb",
        content=glb(text=b"[" * 200_000 + b"]" * 200_000),
        reasons=UNREADABLE,
    ),
    BrokenMesh(name="glb-not-an-object", suffix=".glb", content=glb(text=b'["a", "list"]'), reasons=UNREADABLE),
    BrokenMesh(
        name="glb-compressed-by-draco",
        suffix=".glb",
        content=changed_gltf(
            lambda tree: tree["meshes"][0]["primitives"][0].update(
                extensions={"KHR_draco_mesh_compression": {"bufferView": 9, "attributes": {"POSITION": 0}}}
            )
        ),
        reasons=(ACCEPTED, *NOTHING),
    ),
    BrokenMesh(name="glb-texture-bomb", suffix=".glb", content=pixel_bomb(), reasons=(ACCEPTED, *UNREADABLE)),
    BrokenMesh(name="gltf-path-to-etc-passwd", suffix=".gltf", content=gltf("../../../etc/passwd"), reasons=UNREADABLE),
    BrokenMesh(name="gltf-file-uri", suffix=".gltf", content=gltf("file:///etc/passwd"), reasons=UNREADABLE),
    BrokenMesh(name="gltf-web-address", suffix=".gltf", content=gltf("http://192.0.2.1/mesh.bin"), reasons=UNREADABLE),
    BrokenMesh(name="gltf-name-that-is-markup", suffix=".gltf", content=gltf("[/red].bin"), reasons=UNREADABLE),
    BrokenMesh(
        name="gltf-data-that-is-no-base64",
        suffix=".gltf",
        content=gltf("data:application/octet-stream;base64,%%%%"),
        reasons=UNREADABLE,
    ),
    BrokenMesh(
        name="gltf-data-bomb",
        suffix=".gltf",
        content=gltf("data:application/gzip;base64," + base64.b64encode(gzip.compress(bytes(64 << 20))).decode()),
        reasons=("degenerate",),
    ),
    BrokenMesh(name="gltf-too-large", suffix=".gltf", content=gltf("data:," + "A" * 6_000_000), reasons=("too-large",)),
    BrokenMesh(name="dae-entity-bomb", suffix=".dae", content=entity_bomb(), reasons=UNREADABLE),
    BrokenMesh(
        name="dae-external-entity",
        suffix=".dae",
        content=dae(prologue='<!DOCTYPE C [<!ENTITY secret SYSTEM "secret.txt">]>', title="&secret;"),
        reasons=(ACCEPTED, *UNREADABLE),
    ),
    BrokenMesh(name="dae-node-bomb", suffix=".dae", content=node_bomb(), reasons=("too-many-vertices",)),
    BrokenMesh(
        name="dae-nested-too-deeply",
        suffix=".dae",
        content=dae(nodes="<node>" * 5000 + "</node>" * 5000),
        reasons=NOTHING,
    ),
    BrokenMesh(
        name="obj-material-outside-the-folder",
        suffix=".obj",
        content=obj(head="mtllib ../../secret.mtl\nusemtl secret"),
        reasons=(ACCEPTED,),
    ),
    BrokenMesh(name="obj-endless-line", suffix=".obj", content=obj(head="# " + "a" * 4_000_000), reasons=(ACCEPTED,)),
    BrokenMesh(
        name="obj-face-of-a-hundred-thousand",
        suffix=".obj",
        content=obj(faces=FACES[:0]) + b"f " + b"1 2 3 " * 30_000 + b"\n",
        reasons=(ACCEPTED, "empty", "no-volume", "unreadable"),
    ),
    BrokenMesh(
        name="link-to-unreadable",
        suffix=".obj",
        content=lambda path: path.symlink_to("/proc/self/mem"),
        reasons=UNREADABLE,
    ),
)

SKIPPED: dict[str, Callable[[Path], object]] = {
    "a-folder-called.obj": lambda path: path.mkdir(),
    "a-loop.obj": lambda path: path.symlink_to(path.name),
    "a-dangling-link.stl": lambda path: path.symlink_to("nowhere"),
    "a-folder-that-holds-itself": lambda path: path.symlink_to("."),
    "notes.txt": lambda path: path.write_text("not a mesh"),
}
"""What lies in the folder too and is no mesh file."""

GOOD_MESHES = {"good-a.obj": obj(), "good-b.glb": glb(), "good-c.dae": dae()}
