"""A box in every mesh format, written by hand, so that any part of it can be made wrong."""

import base64
import json
import struct
from collections.abc import Sequence

import numpy as np

CORNERS = 0.05 * np.array([[x, y, z] for x in (-1, 1) for y in (-2, 2) for z in (-1, 1)], dtype=np.float64)
"""A box of 10 x 20 x 10 cm, in metres."""
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def obj(vertices=CORNERS, faces=FACES, *, head: str = "") -> bytes:
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    return "\n".join([head, *lines, ""]).encode()


def stl(vertices=CORNERS, faces=FACES, *, count: int | None = None) -> bytes:
    triangles = b"".join(
        struct.pack("<12fH", 0, 0, 0, *vertices[list(face)].astype(np.float32).ravel(), 0) for face in faces
    )
    return bytes(80) + struct.pack("<I", len(faces) if count is None else count) + triangles


def ascii_stl(vertices=CORNERS, faces=FACES) -> bytes:
    lines = ["solid box"]
    for face in faces:
        corners = "\n".join(f"vertex {x} {y} {z}" for x, y, z in vertices[list(face)])
        lines.append(f"facet normal 0 0 0\nouter loop\n{corners}\nendloop\nendfacet")
    return "\n".join([*lines, "endsolid box", ""]).encode()


def ply(vertices=CORNERS, faces=FACES, *, vertex_count: int | None = None, face_count: int | None = None) -> bytes:
    counts = (
        len(vertices) if vertex_count is None else vertex_count,
        len(faces) if face_count is None else face_count,
    )
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {counts[0]}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {counts[1]}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    body = b"".join(struct.pack("<Biii", 3, *(int(index) for index in face)) for face in faces)
    return header.encode() + np.asarray(vertices, dtype="<f4").tobytes() + body


def gltf_parts(vertices=CORNERS, faces=FACES) -> tuple[dict, bytes]:
    """The JSON of a glTF file, its buffer still without content, and that content."""
    points, indices = np.asarray(vertices, dtype="<f4").tobytes(), np.asarray(faces, dtype="<u2").tobytes()
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3 * len(faces), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(points)},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(indices)},
        ],
        "buffers": [{"byteLength": len(points) + len(indices)}],
    }
    return tree, points + indices


def glb(tree: dict | None = None, buffer: bytes | None = None, *, text: bytes | None = None) -> bytes:
    default_tree, default_buffer = gltf_parts()
    content = text if text is not None else json.dumps(default_tree if tree is None else tree).encode()
    content += b" " * (-len(content) % 4)
    buffer = default_buffer if buffer is None else buffer
    buffer += bytes(-len(buffer) % 4)
    chunks = (
        struct.pack("<II", len(content), 0x4E4F534A) + content + struct.pack("<II", len(buffer), 0x004E4942) + buffer
    )
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def gltf(uri: str | None = None) -> bytes:
    """A glTF file whose buffer is at ``uri``; by default inside the file."""
    tree, buffer = gltf_parts()
    tree["buffers"][0]["uri"] = uri or "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
    return json.dumps(tree).encode()


def dae(
    vertices=CORNERS,
    faces=FACES,
    *,
    prologue: str = "",
    title: str = "",
    count: int | None = None,
    nodes: str = '<instance_geometry url="#box"/>',
    library_nodes: Sequence[str] = (),
) -> bytes:
    numbers = " ".join(f"{value}" for value in np.asarray(vertices).ravel())
    indices = " ".join(str(index) for index in np.asarray(faces).ravel())
    library = f"<library_nodes>{''.join(library_nodes)}</library_nodes>" if library_nodes else ""
    return (
        f'<?xml version="1.0"?>{prologue}'
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f"<asset><title>{title}</title><unit meter='1'/><up_axis>Z_UP</up_axis></asset>"
        '<library_geometries><geometry id="box"><mesh><source id="points">'
        f'<float_array id="values" count="{count or 3 * len(vertices)}">{numbers}</float_array><technique_common>'
        f'<accessor source="#values" count="{(count or 3 * len(vertices)) // 3}" stride="3">'
        '<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>'
        '</accessor></technique_common></source><vertices id="vertices"><input semantic="POSITION" source="#points"/>'
        f'</vertices><triangles count="{len(faces)}"><input semantic="VERTEX" source="#vertices" offset="0"/>'
        f"<p>{indices}</p></triangles></mesh></geometry></library_geometries>{library}"
        f'<library_visual_scenes><visual_scene id="scene"><node id="root">{nodes}</node></visual_scene>'
        '</library_visual_scenes><scene><instance_visual_scene url="#scene"/></scene></COLLADA>'
    ).encode()
