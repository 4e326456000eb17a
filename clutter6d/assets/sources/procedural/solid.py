"""Solids: closed triangle shells for the eye, and the convex parts that make up the same body for physics.

Metres; a primitive stands on z = 0 and is centred in x and y until it is moved.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import manifold3d
import numpy as np
from jaxtyping import Float64, Int32

from clutter6d.assets.asset import Mesh
from clutter6d.assets.sources.procedural.outline import Number

Points = Float64[np.ndarray, "_point 3"]

GRID_DIGITS = 6
"""Vertices are rounded to 1e-6 m, so that the last bits of a machine's sines do not reach the asset."""

SLIVER_M = 1e-5
"""Where shells meet, details smaller than this are smoothed away: on the grid their triangles would have no area."""


@dataclass(frozen=True, slots=True, eq=False)
class Shell:
    """A surface, its triangles counter-clockwise from outside."""

    vertices: Points
    faces: Int32[np.ndarray, "face 3"]


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A rigid body of one material: what is seen, and the corner points of its convex parts."""

    shells: tuple[Shell, ...]
    parts: tuple[Points, ...]

    def __add__(self, other: "Solid") -> "Solid":
        """Both bodies, welded."""
        return Solid(self.shells + other.shells, self.parts + other.parts)

    def seen_only(self) -> "Solid":
        """The body without its convex parts: a thin label, a button, a seam that physics need not feel."""
        return Solid(self.shells, ())

    def felt_as(self, other: "Solid") -> "Solid":
        """The body as it looks, with the convex parts of another."""
        return Solid(self.shells, other.parts)

    def at(self, x: Number = 0.0, y: Number = 0.0, z: Number = 0.0) -> "Solid":
        """The body, moved."""
        return self._mapped(np.eye(3), np.array([x, y, z], dtype=float))

    def turn(self, axis: str, degrees: Number) -> "Solid":
        """The body, rotated about the origin's ``x``, ``y`` or ``z`` axis."""
        cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
        matrix = np.eye(3)
        matrix[[i, i, j, j], [i, j, i, j]] = cosine, -sine, sine, cosine
        return self._mapped(matrix, np.zeros(3))

    def stretch(self, x: Number = 1.0, y: Number = 1.0, z: Number = 1.0) -> "Solid":
        """The body, scaled along the axes about the origin; a negative factor mirrors it."""
        return self._mapped(np.diag(np.array([x, y, z], dtype=float)), np.zeros(3))

    def _mapped(self, matrix: Float64[np.ndarray, "3 3"], shift: Float64[np.ndarray, "3"]) -> "Solid":
        mirrored = np.linalg.det(matrix) < 0
        shells = [
            Shell(transformed(shell.vertices, matrix, shift), shell.faces[:, ::-1] if mirrored else shell.faces)
            for shell in self.shells
        ]
        return Solid(tuple(shells), tuple(transformed(part, matrix, shift) for part in self.parts))


def transformed(points: Points, matrix: Float64[np.ndarray, "3 3"], shift: Float64[np.ndarray, "3"]) -> Points:
    """Points under an affine map, summed in one fixed order (a BLAS product's last bits vary by machine)."""
    columns = [sum(points[:, j] * matrix[i, j] for j in range(3)) + shift[i] for i in range(3)]
    return np.stack(columns, axis=1)


def weld(solids: Sequence[Solid]) -> Solid:
    """All bodies as one."""
    return Solid(
        tuple(shell for solid in solids for shell in solid.shells),
        tuple(part for solid in solids for part in solid.parts),
    )


def loft(rings: Sequence[Points], *, closed: bool = False) -> Shell:
    """The surface through rings of equally many points.

    Args:
        rings: Each counter-clockwise seen against the direction of travel. A first or last ring of one point is a tip.
        closed: Whether the last ring joins the first; otherwise both ends get a cap, a fan about the ring's mean.
    """
    body = [ring for ring in rings if len(ring) > 1]
    size, count = len(body[0]), len(body)
    around = np.arange(size)
    ahead = np.roll(around, -1)
    faces: list[np.ndarray] = []
    for row in range(count if closed else count - 1):
        low, high = row * size, (row + 1) % count * size
        faces.append(np.stack([low + around, low + ahead, high + ahead], axis=1))
        faces.append(np.stack([low + around, high + ahead, high + around], axis=1))
    if closed:
        return Shell(np.concatenate(body), np.concatenate(faces).astype(np.int32))
    first, top = count * size, (count - 1) * size
    faces.append(np.stack([ahead, around, np.full(size, first)], axis=1))
    faces.append(np.stack([top + around, top + ahead, np.full(size, first + 1)], axis=1))
    tips = [rings[i].mean(axis=0, keepdims=True) for i in (0, -1)]
    return Shell(np.concatenate([*body, *tips]), np.concatenate(faces).astype(np.int32))


def on_grid(points: Points) -> Points:
    """Points rounded to the micrometre grid, without negative zeros."""
    return np.round(points, GRID_DIGITS) + 0.0


def hull_mesh(points: Points) -> Mesh:
    """The convex hull of a part's points on the grid, as a mesh."""
    mesh = manifold3d.Manifold.hull_points(on_grid(points)).to_mesh64()
    return Mesh(
        vertices=np.asarray(mesh.vert_properties[:, :3], dtype=np.float32),
        faces=np.asarray(mesh.tri_verts, dtype=np.int32),
    )


def outer_surface(shells: Sequence[Shell]) -> tuple[float, list[Shell]]:
    """What is left of each shell when all that lies inside another is cut away.

    Returns:
        The volume that all shells enclose together [m^3], and the visible part of each shell, in order; where shells
        meet, their vertices coincide and are not shared, so that a renderer keeps the edge.
    """
    bodies = [
        manifold3d.Manifold(manifold3d.Mesh64(on_grid(shell.vertices), shell.faces.astype(np.uint64))).as_original()
        for shell in shells
    ]
    union = manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Add)
    mesh = union.simplify(SLIVER_M).to_mesh64()
    vertices, merged = np.unique(on_grid(mesh.vert_properties[:, :3]), axis=0, return_inverse=True)
    faces = merged.reshape(-1).astype(np.int32)[np.asarray(mesh.tri_verts).astype(int)]
    starts = np.asarray(mesh.run_index).astype(int) // 3
    found: dict[int, list[np.ndarray]] = {}
    for run, origin in enumerate(mesh.run_original_id):
        found.setdefault(int(origin), []).append(faces[starts[run] : starts[run + 1]])
    none = np.zeros((0, 3), dtype=np.int32)
    visible = [_compact(vertices, np.concatenate([none, *found.get(body.original_id(), [])])) for body in bodies]
    return float(union.volume()), visible


def _compact(vertices: Points, faces: Int32[np.ndarray, "_face 3"]) -> Shell:
    """The faces whose corners are apart on the grid, over the vertices they use."""
    a, b, c = faces.T
    used, renumbered = np.unique(faces[(a != b) & (b != c) & (c != a)], return_inverse=True)
    return Shell(vertices[used], renumbered.reshape(-1, 3).astype(np.int32))
