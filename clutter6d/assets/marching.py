"""Marching tetrahedra: the zero surface of a field on a grid, as a closed manifold mesh.

Every cube is cut into the six tetrahedra around its main diagonal, which fit together across cubes. Unlike marching
cubes there is no ambiguous case, so the surface is always a manifold (Doi and Koide, 1991).
"""

from itertools import permutations

import numpy as np
from jaxtyping import Float, Int

_CUBE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]])


def _tetrahedra() -> Int[np.ndarray, "6 4"]:
    """Corner indices of the six tetrahedra, all of positive orientation."""
    result = []
    for order in permutations((1, 2, 4)):
        corners = [0, order[0], order[0] + order[1], 7]
        edges = _CUBE[corners[1:]] - _CUBE[corners[0]]
        result.append(corners if np.linalg.det(edges) > 0 else [corners[1], corners[0], *corners[2:]])
    return np.array(result)


_TETRAHEDRA = _tetrahedra()
_EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))


def march_tetrahedra(
    field: Float[np.ndarray, "x y z"],
) -> tuple[Float[np.ndarray, "vertex 3"], Int[np.ndarray, "face 3"]]:
    """The surface where a field changes sign, turned towards positive values.

    Args:
        field: Values at grid nodes; positive on the whole border, or the surface is open there.

    Returns:
        Vertices in grid coordinates, and triangles.
    """
    inside = field < 0
    x, y, z = (size - 1 for size in field.shape)
    counts = np.zeros((x, y, z), dtype=np.int8)
    for i, j, k in _CUBE.tolist():
        counts += inside[i : i + x, j : j + y, k : k + z].astype(np.int8)
    cubes = np.argwhere((counts > 0) & (counts < 8))
    nodes = np.asarray(np.ravel_multi_index(tuple(np.moveaxis(cubes[:, None] + _CUBE[None], -1, 0)), field.shape))
    tetrahedra = nodes[:, _TETRAHEDRA].reshape(-1, 4)
    ends = _crossed_edges(tetrahedra, inside.ravel()[tetrahedra])
    keys = np.sort(ends, axis=2) @ np.array([field.size, 1])
    unique, faces = np.unique(keys, return_inverse=True)
    return _crossings(field, unique), faces.reshape(-1, 3)


def _crossed_edges(tetrahedra: Int[np.ndarray, "tetrahedron 4"], inside: np.ndarray) -> Int[np.ndarray, "face 3 2"]:
    """For every triangle, the three grid edges its corners lie on, each as its two nodes."""
    case = inside @ np.array([1, 2, 4, 8])
    triangles: list[np.ndarray] = []
    for code in range(1, 15):
        chosen = tetrahedra[case == code]
        for triangle in _TRIANGLES[code]:
            triangles.append(np.stack([chosen[:, list(edge)] for edge in triangle], axis=1))
    return np.concatenate(triangles) if triangles else np.zeros((0, 3, 2), dtype=np.int64)


def _crossings(field: Float[np.ndarray, "x y z"], keys: Int[np.ndarray, "edge"]) -> Float[np.ndarray, "edge 3"]:
    """Where the field, linear along each edge, is zero; kept a little off the nodes so that no triangle collapses."""
    first, second = keys // field.size, keys % field.size
    a, b = field.ravel()[first], field.ravel()[second]
    share = np.clip(a / np.where(a == b, 1.0, a - b), 0.05, 0.95)[:, None]
    start = np.stack(np.unravel_index(first, field.shape), axis=1)
    end = np.stack(np.unravel_index(second, field.shape), axis=1)
    return start + share * (end - start)


def _case_triangles(code: int) -> list[tuple[tuple[int, int], ...]]:
    """Triangles of one case, as crossed edges, turned away from the corners that are inside."""
    inside = [corner for corner in range(4) if code >> corner & 1]
    outside = [corner for corner in range(4) if not code >> corner & 1]
    if len(inside) == 1:
        loops = [[(inside[0], corner) for corner in outside]]
    elif len(inside) == 3:
        loops = [[(outside[0], corner) for corner in inside]]
    else:
        (a, b), (c, d) = inside, outside
        ring = [(a, c), (a, d), (b, d), (b, c)]
        loops = [[ring[0], ring[1], ring[2]], [ring[0], ring[2], ring[3]]]
    return [_outward(tuple(loop), inside, outside) for loop in loops]


def _outward(
    triangle: tuple[tuple[int, int], ...], inside: list[int], outside: list[int]
) -> tuple[tuple[int, int], ...]:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    points = np.array([corners[list(edge)].mean(axis=0) for edge in triangle])
    normal = np.cross(points[1] - points[0], points[2] - points[0])
    away = corners[outside].mean(axis=0) - corners[inside].mean(axis=0)
    return triangle if normal @ away > 0 else (triangle[0], triangle[2], triangle[1])


_TRIANGLES = {code: _case_triangles(code) for code in range(1, 15)}
