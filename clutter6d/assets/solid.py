"""Turning any triangle soup into a closed solid.

A mesh whose components are all closed is taken as it is: its components are turned outward and united. Anything else
is wrapped: a closed surface is drawn around the soup at a small offset, on a grid, and then shrunk back onto it.
Closed hollows become solid; open sheets become thin plates.
"""

from dataclasses import dataclass

import fast_simplification
import manifold3d
import numpy as np
import trimesh
from jaxtyping import Bool, Float, Int
from scipy import ndimage
from scipy.spatial import cKDTree

from clutter6d.assets.marching import march_tetrahedra
from clutter6d.assets.surface_distance import SurfaceDistance, sample_surface
from clutter6d.errors import MeshRejectedError
from clutter6d.seeding import generator


@dataclass(frozen=True, kw_only=True, slots=True)
class SolidSettings:
    """How a soup becomes a solid.

    Attributes:
        faces: Triangles that are kept; a few thousand are enough for convex parts of 32 vertices.
        grid_cells: Grid cells along the longest side of a wrap.
        offset_cells: Distance of the first surface around the soup, in cells; gaps twice as wide are closed.
        sheet_thickness_m: Thickness of a plate made of an open sheet. Thinner ones tunnel in simulation.
        closing_cells: The same, tried where the wrap is a thin shell: a bag with a slit, a doubled wall with a gap.
        thin_shell: Share of its hull under which a wrap counts as a thin shell.
        max_components: A soup of more closed components than this is wrapped rather than united.
    """

    faces: int = 3000
    grid_cells: int = 48
    offset_cells: float = 0.8
    sheet_thickness_m: float = 0.001
    closing_cells: float = 2.5
    thin_shell: float = 0.25
    max_components: int = 100


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ClosedSolid:
    """A closed solid.

    Attributes:
        manifold: The solid.
        was_watertight: Whether the soup's own components were closed.
        fallbacks: What did not go the normal way.
    """

    manifold: manifold3d.Manifold
    was_watertight: bool
    fallbacks: tuple[str, ...]

    def arrays(self) -> tuple[Float[np.ndarray, "vertex 3"], Int[np.ndarray, "face 3"]]:
        """Vertices and triangles."""
        return manifold_arrays(self.manifold)


def manifold_arrays(
    manifold: manifold3d.Manifold,
) -> tuple[Float[np.ndarray, "vertex 3"], Int[np.ndarray, "face 3"]]:
    """Vertices and triangles of a manifold."""
    mesh = manifold.to_mesh64()
    vertices = np.array(mesh.vert_properties[:, :3], dtype=np.float64, order="C")
    return vertices, np.array(mesh.tri_verts, dtype=np.int64, order="C")


def to_manifold(
    vertices: Float[np.ndarray, "vertex 3"], faces: Int[np.ndarray, "face 3"]
) -> manifold3d.Manifold | None:
    """A manifold of the triangles, or ``None`` if they do not bound a solid of positive volume."""
    mesh = manifold3d.Mesh64(
        np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(faces, dtype=np.uint64)
    )
    manifold = manifold3d.Manifold(mesh)
    if manifold.status() != manifold3d.Error.NoError or manifold.is_empty() or manifold.volume() <= 0:
        return None
    return manifold


def close_solid(
    vertices: Float[np.ndarray, "vertex 3"], faces: Int[np.ndarray, "face 3"], settings: SolidSettings
) -> ClosedSolid:
    """Make a closed solid of a triangle soup.

    Args:
        vertices: Vertices [m].
        faces: Triangles.
        settings: How.

    Raises:
        MeshRejectedError: No solid of positive volume was found.
    """
    soup = trimesh.Trimesh(vertices, faces, process=False)
    united = _unite_components(soup, settings.max_components)
    if united is not None:
        return ClosedSolid(manifold=simplify_solid(united, settings.faces), was_watertight=True, fallbacks=())
    soup.merge_vertices(digits_vertex=6)
    soup.update_faces(soup.nondegenerate_faces() & soup.unique_faces())
    if not len(soup.faces) or soup.area <= 0:
        raise MeshRejectedError("degenerate", "none of its triangles has an area")
    united = _unite_components(soup, settings.max_components)
    if united is not None:
        return ClosedSolid(manifold=simplify_solid(united, settings.faces), was_watertight=True, fallbacks=())
    return _wrapped(np.asarray(soup.vertices), np.asarray(soup.faces), settings)


def _wrapped(
    vertices: Float[np.ndarray, "vertex 3"], faces: Int[np.ndarray, "face 3"], settings: SolidSettings
) -> ClosedSolid:
    """The wrap; or, where it is a thin shell, a wrap over wider gaps if that encloses far more."""
    wrapped = _wrap(vertices, faces, settings, settings.offset_cells)
    if wrapped is None:
        raise MeshRejectedError("no-solid", "no closed solid of positive volume could be made of its triangles")
    fallbacks = ("solid:wrapped",)
    if wrapped.volume() < settings.thin_shell * wrapped.hull().volume():
        closed = _wrap(vertices, faces, settings, settings.closing_cells)
        if closed is not None and closed.volume() > 2.5 * wrapped.volume():
            wrapped, fallbacks = closed, ("solid:wrapped", "solid:gaps-closed")
    return ClosedSolid(manifold=simplify_solid(wrapped, settings.faces), was_watertight=False, fallbacks=fallbacks)


def _unite_components(soup: trimesh.Trimesh, max_components: int) -> manifold3d.Manifold | None:
    """The union of the soup's components, each turned outward, if all of them are closed."""
    if not soup.is_watertight or soup.body_count > max_components:
        return None
    bodies: list[manifold3d.Manifold] = []
    for part in soup.split(only_watertight=False, repair=False):
        if not part.is_winding_consistent:
            trimesh.repair.fix_winding(part)
        if part.volume < 0:
            part.invert()
        body = to_manifold(np.asarray(part.vertices), np.asarray(part.faces))
        if body is None:
            return None
        bodies.append(body)
    united = manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Add) if len(bodies) > 1 else bodies[0]
    return None if united.is_empty() or united.volume() <= 0 else united


def _wrap(
    vertices: Float[np.ndarray, "vertex 3"],
    faces: Int[np.ndarray, "face 3"],
    settings: SolidSettings,
    offset_cells: float,
) -> manifold3d.Manifold | None:
    """A closed surface around the soup, shrunk back onto it; ``None`` if it encloses nothing."""
    low, high = vertices[faces].min(axis=(0, 1)), vertices[faces].max(axis=(0, 1))
    cell = float((high - low).max()) / settings.grid_cells
    margin = int(np.ceil(offset_cells)) + 2
    origin = low - margin * cell
    shape = np.ceil((high - low) / cell).astype(int) + 2 * margin + 1
    field = _offset_field(vertices, faces, origin, cell, shape, offset_cells)
    nodes, triangles = march_tetrahedra(field)
    if not len(triangles):
        return None
    around = nodes * cell + origin
    nearest, distance = SurfaceDistance(vertices, faces, samples=30_000).closest(around, neighbours=3)
    direction = (around - nearest) / np.maximum(distance, 1e-12)[:, None]
    return to_manifold(nearest + direction * settings.sheet_thickness_m / 2, triangles)


def _offset_field(
    vertices: Float[np.ndarray, "vertex 3"],
    faces: Int[np.ndarray, "face 3"],
    origin: Float[np.ndarray, "3"],
    cell: float,
    shape: Int[np.ndarray, "3"],
    offset_cells: float,
) -> Float[np.ndarray, "x y z"]:
    """Distance to the soup minus the offset, in cells, at grid nodes; negative also where no path leads outside."""
    corners = vertices[faces]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    count = int(np.clip(12 * area / cell**2, 2_000, 400_000))
    points, _ = sample_surface(vertices, faces, count, generator(0, "wrap"))
    points = (np.concatenate([points, vertices[np.unique(faces)]]) - origin) / cell
    near = np.zeros(shape, dtype=bool)
    near[tuple(np.round(points).astype(int).T)] = True
    near = ndimage.binary_dilation(
        near, ndimage.generate_binary_structure(3, 3), iterations=int(np.ceil(offset_cells)) + 1
    )
    distance = np.full(shape, offset_cells + 3.0)
    distance[near] = cKDTree(points).query(np.argwhere(near), k=1)[0]
    field = distance - offset_cells
    return np.where(_is_outside(field > 0) | (field <= 0), field, -offset_cells)


def _is_outside(is_free: Bool[np.ndarray, "x y z"]) -> Bool[np.ndarray, "x y z"]:
    labels, _ = ndimage.label(is_free)
    return labels == labels[0, 0, 0]


def simplify_solid(solid: manifold3d.Manifold, max_faces: int) -> manifold3d.Manifold:
    """The solid with about so many faces; with more where fewer would lose a piece or a tenth of the volume."""
    longest = float(_sides(solid).max())
    for tolerance in (1e-4, 5e-4, 1e-3):
        if solid.num_tri() <= max_faces:
            return solid
        simpler = solid.simplify(tolerance * longest)
        if _is_like(simpler, solid):
            solid = simpler
    for target in (max_faces, 2 * max_faces, 4 * max_faces):
        if solid.num_tri() <= target:
            break
        points, triangles = fast_simplification.simplify(*manifold_arrays(solid), target_count=target)
        simpler = to_manifold(np.asarray(points, dtype=np.float64), np.asarray(triangles))
        if simpler is not None and _is_like(simpler, solid):
            return simpler
    return solid


def _is_like(simpler: manifold3d.Manifold, solid: manifold3d.Manifold) -> bool:
    """Whether a simplified solid has kept volume and size."""
    if simpler.is_empty() or not 0.9 <= simpler.volume() / solid.volume() <= 1.1:
        return False
    sides = _sides(solid)
    return bool((np.abs(_sides(simpler) - sides) <= 0.03 * sides.max()).all())


def _sides(solid: manifold3d.Manifold) -> Float[np.ndarray, "3"]:
    box = np.array(solid.bounding_box())
    return box[3:] - box[:3]
