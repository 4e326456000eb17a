"""Where an object can be touched: points on the surface of its convex parts, with outward normals."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from clutter6d.assets.asset import Asset, Mesh
from clutter6d.seeding import generator

_DRAWN = 1024
_KEPT = 256
_INSIDE_M = 5e-4


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ContactPoints:
    """Points in the object frame [m] and their outward unit normals, in random order."""

    points: Float64[np.ndarray, "point 3"]
    normals: Float64[np.ndarray, "point 3"]


def sample_contact_points(asset: Asset) -> ContactPoints:
    """Points spread by area over the parts' surfaces, without those that lie inside another part."""
    rng = generator(0, "contact_points", asset.content_hash)
    planes = [_planes(part) for part in asset.parts]
    corners = np.concatenate([part.vertices[part.faces].astype(np.float64) for part in asset.parts])
    normals = np.concatenate([plane_normals for plane_normals, _ in planes])
    owner = np.repeat(np.arange(len(asset.parts)), [len(part.faces) for part in asset.parts])
    edges = corners[:, 1:] - corners[:, :1]
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1)
    face = rng.choice(len(areas), size=_DRAWN, p=areas / areas.sum())
    u, v = rng.random((2, _DRAWN, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    points = corners[face, 0] + u * edges[face, 0] + v * edges[face, 1]
    is_covered = np.zeros(_DRAWN, dtype=bool)
    for index, (plane_normals, offsets) in enumerate(planes):
        is_covered |= _is_inside(points, plane_normals, offsets) & (owner[face] != index)
    free = np.flatnonzero(~is_covered)[:_KEPT]
    chosen = free if len(free) else np.arange(_KEPT)
    return ContactPoints(points=points[chosen], normals=normals[face[chosen]])


def _planes(part: Mesh) -> tuple[Float64[np.ndarray, "face 3"], Float64[np.ndarray, "face"]]:
    """Outward unit normals of a convex part's faces, and their offsets ``n . x``."""
    corners = part.vertices[part.faces].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-15)
    outward = ((corners[:, 0] - part.vertices.mean(axis=0)) * normals).sum(axis=-1)
    normals = normals * np.where(outward < 0, -1.0, 1.0)[:, None]
    return normals, (corners[:, 0] * normals).sum(axis=-1)


def _is_inside(
    points: Float64[np.ndarray, "point 3"],
    normals: Float64[np.ndarray, "face 3"],
    offsets: Float64[np.ndarray, "face"],
) -> Bool[np.ndarray, "point"]:
    depth = (points[:, None] * normals).sum(axis=-1) - offsets
    return (depth < -_INSIDE_M).all(axis=1)
