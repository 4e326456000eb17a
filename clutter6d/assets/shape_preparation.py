"""Bringing a raw shape to its real size, and its visual meshes to a size a renderer likes."""

from dataclasses import dataclass, replace

import fast_simplification
import numpy as np
import trimesh
from jaxtyping import Float, Float64, Int

from clutter6d.assets.asset import LARGE_EXTENT_M, SMALL_EXTENT_M, Mesh, VisualMesh
from clutter6d.assets.sources.base import RawShape, SourceObject
from clutter6d.errors import MeshRejectedError
from clutter6d.seeding import generator

EXTENT_RANGE_M = (0.004, 2.0)
LARGE_SHARE = 1 / 3
_MAX_BOX_CHANGE = 0.005


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Soup:
    """All triangles of a shape in one mesh, vertices of one place merged."""

    vertices: Float64[np.ndarray, "vertex 3"]
    faces: Int[np.ndarray, "face 3"]


def join_visuals(visual: tuple[VisualMesh, ...]) -> Soup:
    """All triangles together.

    Raises:
        MeshRejectedError: There is none, or a vertex is not finite.
    """
    meshes = [item.mesh for item in visual if len(item.mesh.faces)]
    if not meshes:
        raise MeshRejectedError("empty", "the shape has no triangle")
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])[:-1]
    vertices = np.concatenate([mesh.vertices for mesh in meshes]).astype(np.float64)
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]).astype(np.int64)
    if not np.isfinite(vertices[faces]).all():
        raise MeshRejectedError("not-finite", "some vertices are NaN or infinite")
    return Soup(vertices=vertices, faces=faces)


def scale_to_real_size(item: SourceObject, shape: RawShape, *, seed: int) -> RawShape:
    """The shape in metres.

    With known side lengths, each axis is scaled to its own (a flat axis keeps its scale). A shape of unknown unit is
    normalised and given a tabletop size drawn from its key: one in three is large (0.25 to 0.35 m), the others small
    (0.06 to 0.25 m), uniform in the longest side.

    Raises:
        MeshRejectedError: The shape is a point or a line, or its size is not that of a household object.
    """
    soup = join_visuals(shape.visual)
    used = soup.vertices[soup.faces]
    sides = np.ptp(used.reshape(-1, 3), axis=0)
    if np.sort(sides)[1] <= 1e-9 * max(sides.max(), 1e-300) or sides.max() <= 0:
        raise MeshRejectedError("degenerate", "the shape is a point or a line")
    if item.extents_m is not None:
        is_flat = sides <= 1e-6 * sides.max()
        scale = np.where(is_flat, 1.0, np.array(item.extents_m) / np.where(is_flat, 1.0, sides))
    elif item.is_metric:
        scale = np.ones(3)
    else:
        scale = np.full(3, draw_tabletop_size(item, seed=seed) / sides.max())
    longest = float((sides * scale).max())
    if not EXTENT_RANGE_M[0] <= longest <= EXTENT_RANGE_M[1]:
        low, high = EXTENT_RANGE_M
        raise MeshRejectedError(
            "implausible-size", f"longest side {longest:.4g} m is not within {low} and {high} m; is the unit right?"
        )
    return shape if (scale == 1).all() else _scale(shape, scale)


def draw_tabletop_size(item: SourceObject, *, seed: int) -> float:
    """The longest side given to an object of unknown unit [m]."""
    rng = generator(seed, "tabletop-size", item.licence.source, item.key)
    low, high = LARGE_EXTENT_M if rng.random() < LARGE_SHARE else SMALL_EXTENT_M
    return float(rng.uniform(low, high))


def _scale(shape: RawShape, scale: Float64[np.ndarray, "3"]) -> RawShape:
    """A scaled shape; what its construction says of mass and symmetry holds for its own size only."""

    def scaled(mesh: Mesh) -> Mesh:
        return Mesh(vertices=(mesh.vertices * scale).astype(np.float32), faces=mesh.faces)

    parts = None if shape.parts is None else tuple(scaled(part) for part in shape.parts)
    return RawShape(visual=tuple(replace(item, mesh=scaled(item.mesh)) for item in shape.visual), parts=parts)


def move_origin(mesh: Mesh, origin: Float[np.ndarray, "3"]) -> Mesh:
    """The mesh seen from another origin."""
    vertices = (mesh.vertices.astype(np.float64) - origin).astype(np.float32)
    return Mesh(vertices=vertices, faces=mesh.faces.astype(np.int32))


def simplify_visuals(visual: tuple[VisualMesh, ...], max_faces: int) -> tuple[VisualMesh, ...]:
    """Visual meshes with about so many faces in all, without faces of no area and without unused vertices."""
    clean = [replace(item, mesh=_clean(item.mesh)) for item in visual]
    total = sum(len(item.mesh.faces) for item in clean)
    result = tuple(replace(item, mesh=_simplify(item.mesh, max_faces / max(total, 1))) for item in clean)
    return tuple(item for item in result if len(item.mesh.faces)) or visual


def _clean(mesh: Mesh) -> Mesh:
    found = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    found.merge_vertices(digits_vertex=6)
    found.update_faces(found.nondegenerate_faces(height=1e-7))
    found.remove_unreferenced_vertices()
    return _to_mesh(found.vertices, found.faces)


def _simplify(mesh: Mesh, share: float) -> Mesh:
    """The mesh with a share of its faces; with more, or all, where fewer would change its size."""
    vertices = np.array(mesh.vertices, dtype=np.float32, order="C")
    for factor in (1, 2, 4):
        if factor * share >= 1 or len(mesh.faces) < 64:
            return mesh
        target = max(int(factor * share * len(mesh.faces)), 32)
        points, faces = fast_simplification.simplify(vertices, np.array(mesh.faces, order="C"), target_count=target)
        used, renumbered = np.unique(faces, return_inverse=True)
        if len(used) and _has_same_box(points[used], vertices):
            return _to_mesh(np.asarray(points)[used], renumbered.reshape(-1, 3))
    return mesh


def _has_same_box(points: Float[np.ndarray, "point 3"], vertices: Float[np.ndarray, "vertex 3"]) -> bool:
    """Whether simplified points span the box of the original ones; on slivers the simplifier can throw one far."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    change = np.abs(np.concatenate([points.min(axis=0) - low, points.max(axis=0) - high]))
    return bool((change <= _MAX_BOX_CHANGE * float((high - low).max())).all())


def _to_mesh(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    return Mesh(vertices=np.asarray(vertices, dtype=np.float32), faces=np.asarray(faces, dtype=np.int32))
