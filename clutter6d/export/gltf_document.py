"""A glTF 2.0 document in the making: nodes, meshes of one colour, and the binary file they become."""

import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from clutter6d.export.colour import srgb_to_linear

Colour = tuple[float, float, float, float]

_MAGIC, _VERSION, _JSON, _BINARY = b"glTF", 2, b"JSON", b"BIN\0"
_FLOAT, _UNSIGNED_INT = 5126, 5125
_VERTICES, _INDICES = 34962, 34963


class GltfDocument:
    """Collects nodes and meshes.

    Args:
        asset: What glTF's ``asset`` says besides the version: generator, copyright, extras.
    """

    def __init__(self, asset: dict[str, Any]) -> None:
        self._asset = {"version": "2.0", **asset}
        self._binary = bytearray()
        self._lists: dict[str, list[dict[str, Any]]] = {
            name: [] for name in ("nodes", "meshes", "materials", "accessors", "bufferViews")
        }
        self._materials: dict[Colour, int] = {}

    def add_node(
        self,
        name: str,
        *,
        children: Sequence[int] = (),
        mesh: int | None = None,
        position: Float[np.ndarray, "3"] | None = None,
        quat_wxyz: Float[np.ndarray, "4"] | None = None,
        extras: dict[str, Any] | None = None,
    ) -> int:
        """Add a node below which others are; returns its index."""
        node: dict[str, Any] = {"name": name}
        if children:
            node["children"] = list(children)
        if mesh is not None:
            node["mesh"] = mesh
        if position is not None:
            node["translation"] = [float(value) for value in position]
        if quat_wxyz is not None:
            node["rotation"] = [float(value) for value in np.roll(quat_wxyz, -1)]
        if extras:
            node["extras"] = extras
        return self._add("nodes", node)

    def add_mesh(self, name: str, shapes: Sequence[tuple["Triangles", Colour]]) -> int:
        """Add a mesh of one or more shapes, each in one colour (RGBA as shown on a screen); returns its index."""
        primitives = [
            {
                "attributes": {"POSITION": triangles.positions},
                "indices": triangles.indices,
                "material": self._material(rgba),
            }
            for triangles, rgba in shapes
        ]
        return self._add("meshes", {"name": name, "primitives": primitives})

    def add_triangles(self, vertices: Float[np.ndarray, "vertex 3"], faces: Int[np.ndarray, "face 3"]) -> "Triangles":
        """Add the data of a shape, which any number of meshes may show; without normals, so shown with flat faces."""
        points, indices = np.asarray(vertices, dtype="<f4"), np.asarray(faces, dtype="<u4").ravel()
        bounds = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
        view = {"bufferView": self._view(points, _VERTICES), "componentType": _FLOAT, "type": "VEC3"}
        positions = self._add("accessors", {**view, "count": len(points), **bounds})
        view = {"bufferView": self._view(indices, _INDICES), "componentType": _UNSIGNED_INT, "type": "SCALAR"}
        return Triangles(positions, self._add("accessors", {**view, "count": len(indices)}))

    def to_glb(self, root: int, *, extras: dict[str, Any]) -> bytes:
        """The binary file whose scene has one root node."""
        content = {
            "asset": self._asset,
            "scene": 0,
            "scenes": [{"nodes": [root], "extras": extras}],
            **self._lists,
            "buffers": [{"byteLength": len(self._binary)}],
        }
        text = json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
        chunks = _chunk(_JSON, text, b" ") + _chunk(_BINARY, bytes(self._binary), b"\0")
        return struct.pack("<4sII", _MAGIC, _VERSION, 12 + len(chunks)) + chunks

    def _material(self, rgba: Colour) -> int:
        if rgba not in self._materials:
            pbr = {
                "baseColorFactor": [*srgb_to_linear(rgba[:3]), float(rgba[3])],
                "metallicFactor": 0.0,
                "roughnessFactor": 0.6,
            }
            look: dict[str, Any] = {"pbrMetallicRoughness": pbr, "doubleSided": True}
            if rgba[3] < 1:
                look["alphaMode"] = "BLEND"
            self._materials[rgba] = self._add("materials", look)
        return self._materials[rgba]

    def _view(self, values: np.ndarray, target: int) -> int:
        content = values.tobytes()
        view = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": len(content), "target": target}
        self._binary += content
        return self._add("bufferViews", view)

    def _add(self, kind: str, item: dict[str, Any]) -> int:
        self._lists[kind].append(item)
        return len(self._lists[kind]) - 1


class Triangles:
    """Where the data of a shape is in the document."""

    def __init__(self, positions: int, indices: int) -> None:
        self.positions, self.indices = positions, indices


def _chunk(kind: bytes, content: bytes, padding: bytes) -> bytes:
    content += padding * (-len(content) % 4)
    return struct.pack("<I4s", len(content), kind) + content
