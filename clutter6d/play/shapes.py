"""What of a model is to be seen, as triangles on bodies: for viewers that know nothing of MuJoCo."""

from collections import defaultdict
from dataclasses import dataclass

import mujoco
import numpy as np
import trimesh
from jaxtyping import Float64, Int

from clutter6d.geometry import rotate
from clutter6d.render.studio import SHOWN_GROUPS

CREASE_RAD = np.deg2rad(35.0)
"""Edges that are sharper are shown sharp."""
FLOOR_HALF_M = 4.0
"""Half the side of a plane without bounds."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Shape:
    """Everything of one colour on one body.

    Attributes:
        body: The body's id; 0 is the world.
        rgb: Colour, 0 to 255.
        opacity: 1 for what is not translucent.
        vertices: In the body's frame [m]; split where an edge is sharp.
        faces: Indices of vertices.
    """

    body: int
    rgb: tuple[int, int, int]
    opacity: float
    vertices: Float64[np.ndarray, "vertex 3"]
    faces: Int[np.ndarray, "face 3"]


def visible_shapes(model: mujoco.MjModel) -> tuple[Shape, ...]:
    """The shapes of a model's visible geoms, by body; what has one colour is one shape."""
    parts: dict[tuple[int, tuple[float, ...]], list[trimesh.Trimesh]] = defaultdict(list)
    for geom in range(model.ngeom):
        if model.geom_group[geom] in SHOWN_GROUPS:
            key = int(model.geom_bodyid[geom]), tuple(float(value) for value in model.geom_rgba[geom])
            parts[key].append(_on_body(model, geom))
    return tuple(_merge(body, rgba, meshes) for (body, rgba), meshes in sorted(parts.items(), key=lambda item: item[0]))


def _merge(body: int, rgba: tuple[float, ...], meshes: list[trimesh.Trimesh]) -> Shape:
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, first[:-1], strict=True)])
    red, green, blue, opacity = rgba
    rgb = round(255 * red), round(255 * green), round(255 * blue)
    return Shape(body=body, rgb=rgb, opacity=opacity, vertices=np.asarray(vertices), faces=np.asarray(faces))


def _on_body(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
    """A geom's triangles in its body's frame."""
    mesh = trimesh.graph.smooth_shade(_in_geom_frame(model, geom), angle=CREASE_RAD)
    mesh.vertices = rotate(model.geom_quat[geom], np.asarray(mesh.vertices)) + model.geom_pos[geom]
    return mesh


def _in_geom_frame(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
    kind, size = model.geom_type[geom], model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.mesh(model.geom_dataid[geom])
        vertices = model.mesh_vert[mesh.vertadr[0] : mesh.vertadr[0] + mesh.vertnum[0]]
        faces = model.mesh_face[mesh.faceadr[0] : mesh.faceadr[0] + mesh.facenum[0]]
        return trimesh.Trimesh(vertices=vertices, faces=faces, process=False)
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return trimesh.creation.box(extents=2 * size)
    if kind == mujoco.mjtGeom.mjGEOM_PLANE:
        half = np.where(size[:2] > 0, size[:2], FLOOR_HALF_M)
        corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [*half, 0]
        return trimesh.Trimesh(vertices=corners, faces=[[0, 1, 2], [0, 2, 3]], process=False)
    raise NotImplementedError(f"geom of type {kind} is not drawn")
