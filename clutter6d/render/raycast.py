"""A small ray caster for machines without OpenGL: MuJoCo's own ray queries, shaded with NumPy.

Lambert shading under a hemispherical sky, one key light with soft shadows, one fill light, a little haze; four samples
for pixels on an edge and one for the others. Geoms of ``GHOST_GROUP`` are drawn translucent, by their alpha.
"""

import os
from typing import NamedTuple

import mujoco
import numpy as np
from jaxtyping import Bool, Float64, Int32, UInt8
from mujoco.batch import Batch

from clutter6d.render.camera import Camera
from clutter6d.render.studio import FILL_DIRECTION, GHOST_GROUP, KEY_DIRECTION, SKY_HORIZON, SKY_TOP

Points = Float64[np.ndarray, "ray 3"]

_KEY, _FILL, _SKY, _GROUND = 0.52, 0.14, 0.50, 0.30
_LIGHT_RADIUS, _LIGHT_SAMPLES = 0.06, 8
_HAZE_START_M, _HAZE_DEPTH_M = 3.0, 9.0
_SURFACE_OFFSET_M = 5e-4
_SUBSAMPLES = ((-0.125, -0.375), (0.375, -0.125), (0.125, 0.375), (-0.375, 0.125))
_MAX_THREADS = 8


class _Hits(NamedTuple):
    distance: Float64[np.ndarray, "ray"]
    geom: Int32[np.ndarray, "ray"]
    normal: Points


class RaycastRenderer:
    """Draws one model without OpenGL.

    Args:
        model: The model; it is not changed.
        width: Of the picture [px].
        height: Of the picture [px].
        geom_groups: Which groups of geoms are shown.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int, geom_groups: tuple[int, ...]) -> None:
        self._width, self._height = width, height
        self._threads = min(os.cpu_count() or 1, _MAX_THREADS)
        self._batch = Batch(model, self._threads, self._threads)
        self._qpos = self._batch.bind("qpos")
        has_material = model.geom_matid >= 0
        self._rgba = model.geom_rgba.astype(np.float64)
        self._rgba[has_material] = model.mat_rgba[model.geom_matid[has_material]]
        self._solid = _group_mask(tuple(set(geom_groups) - {GHOST_GROUP}))
        has_ghosts = GHOST_GROUP in geom_groups and bool((model.geom_group == GHOST_GROUP).any())
        self._ghost = _group_mask((GHOST_GROUP,)) if has_ghosts else None

    def draw(self, qpos: Float64[np.ndarray, "nq"], camera: Camera) -> UInt8[np.ndarray, "height width 3"]:
        """The picture of one configuration."""
        self._qpos[:] = qpos
        shape = (self._height, self._width)
        rows, columns = (axis.ravel().astype(np.float64) for axis in np.indices(shape))
        colour, geom = self._shade(camera, columns, rows)
        is_edge = _edges(colour.reshape(*shape, 3), geom.reshape(shape)).ravel()
        samples = [self._shade(camera, columns[is_edge] + dx, rows[is_edge] + dy)[0] for dx, dy in _SUBSAMPLES]
        colour[is_edge] = np.mean(samples, axis=0)
        return np.rint(255 * np.clip(colour, 0, 1)).astype(np.uint8).reshape(*shape, 3)

    def measure(
        self, qpos: Float64[np.ndarray, "nq"], camera: Camera
    ) -> tuple[Float64[np.ndarray, "height width"], Int32[np.ndarray, "height width"]]:
        """What is seen through the centres of the pixels; ghosts are not.

        Returns:
            Depth along the optical axis [m], 0 where nothing is hit; geom, -1 where there is none.
        """
        self._qpos[:] = qpos
        shape = (self._height, self._width)
        down, right = np.indices(shape).reshape(2, -1) - (np.array([shape]).T - 1) / 2
        directions = _directions(camera, right, down, self._height)
        hits = self._cast(np.broadcast_to(camera.position(), directions.shape), directions, self._solid, normal=False)
        depth = np.where(hits.geom >= 0, hits.distance * (directions @ camera.forward()), 0.0)
        return depth.reshape(shape), hits.geom.reshape(shape)

    def close(self) -> None:
        """Nothing is held; here for likeness with the OpenGL renderer."""

    def _shade(
        self, camera: Camera, columns: Float64[np.ndarray, "ray"], rows: Float64[np.ndarray, "ray"]
    ) -> tuple[Points, Int32[np.ndarray, "ray"]]:
        """Colour and geom seen through points of the picture [px]."""
        directions = _directions(camera, columns - (self._width - 1) / 2, rows - (self._height - 1) / 2, self._height)
        origin = np.broadcast_to(camera.position(), directions.shape)
        hits = self._cast(origin, directions, self._solid)
        colour = _sky(directions)
        seen = hits.geom >= 0
        points = origin[seen] + hits.distance[seen, None] * directions[seen]
        light = self._light(points, hits.normal[seen])
        haze = np.clip((hits.distance[seen, None] - _HAZE_START_M) / _HAZE_DEPTH_M, 0, 1)
        colour[seen] = haze * SKY_HORIZON + (1 - haze) * light[:, None] * self._rgba[hits.geom[seen], :3]
        return (colour, hits.geom) if self._ghost is None else self._with_ghosts(colour, hits, origin, directions)

    def _with_ghosts(
        self, colour: Points, solid: _Hits, origin: Points, directions: Points
    ) -> tuple[Points, Int32[np.ndarray, "ray"]]:
        hits = self._cast(origin, directions, self._ghost)
        seen = (hits.geom >= 0) & ((solid.geom < 0) | (hits.distance < solid.distance))
        rgba = self._rgba[hits.geom[seen]]
        tone = 0.75 + 0.35 * np.abs(hits.normal[seen] @ KEY_DIRECTION)
        colour[seen] = rgba[:, 3:] * rgba[:, :3] * tone[:, None] + (1 - rgba[:, 3:]) * colour[seen]
        return colour, np.where(seen, hits.geom, solid.geom)

    def _light(self, points: Points, normals: Points) -> Float64[np.ndarray, "ray"]:
        """Light that surface points receive."""
        facing = normals @ KEY_DIRECTION
        visible = np.zeros(len(points))
        lit = facing > 0
        visible[lit] = self._visibility(points[lit] + _SURFACE_OFFSET_M * normals[lit])
        sky = _GROUND + (_SKY - _GROUND) * (0.5 + 0.5 * normals[:, 2])
        return sky + _KEY * np.maximum(facing, 0) * visible + _FILL * np.maximum(normals @ FILL_DIRECTION, 0)

    def _visibility(self, points: Points) -> Float64[np.ndarray, "ray"]:
        """Share of the key light's disc seen from points; fully sampled only where two samples disagree."""
        samples = _light_samples()
        first, opposite = (self._sees(points, samples[index]) for index in (0, len(samples) // 2))
        share = first.astype(np.float64)
        partial = first != opposite
        share[partial] = np.mean([self._sees(points[partial], sample) for sample in samples], axis=0)
        return share

    def _sees(self, points: Points, direction: Float64[np.ndarray, "3"]) -> Bool[np.ndarray, "ray"]:
        return self._cast(points, np.broadcast_to(direction, points.shape), self._solid, normal=False).geom < 0

    def _cast(
        self, origins: Points, directions: Points, group: UInt8[np.ndarray, "6"] | None, *, normal: bool = True
    ) -> _Hits:
        """Nearest hits, spread over the threads."""
        count = len(origins)
        if count == 0:
            return _Hits(np.empty(0), np.empty(0, np.int32), np.empty((0, 3)))
        padded = np.minimum(np.arange(-(-count // self._threads) * self._threads), count - 1)
        split = (self._threads, -1, 3)
        found = self._batch.ray(
            origins[padded].reshape(split), directions[padded].reshape(split), geomgroup=group, normal=normal
        )
        normals = found[2].reshape(-1, 3)[:count] if normal else np.empty((0, 3))
        return _Hits(found[0].ravel()[:count], found[1].ravel()[:count].astype(np.int32), normals)


def _directions(
    camera: Camera, right_px: Float64[np.ndarray, "ray"], down_px: Float64[np.ndarray, "ray"], height: int
) -> Points:
    forward = camera.forward()
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    scale = 2 * np.tan(np.deg2rad(camera.vertical_fov_deg) / 2) / height
    rays = forward + scale * (right_px[:, None] * right + down_px[:, None] * down)
    return rays / np.sqrt((rays**2).sum(axis=1, keepdims=True))


def _sky(directions: Points) -> Points:
    height = np.clip(directions[:, 2:] * 1.6, 0, 1)
    return height * SKY_TOP + (1 - height) * SKY_HORIZON


def _light_samples() -> Float64[np.ndarray, "sample 3"]:
    """Directions to points spread over the key light's disc; the first and the middle one lie opposite."""
    side = np.cross(KEY_DIRECTION, [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    other = np.cross(KEY_DIRECTION, side)
    angle = 2 * np.pi * np.arange(_LIGHT_SAMPLES)[:, None] / _LIGHT_SAMPLES
    radius = _LIGHT_RADIUS * np.where(np.arange(_LIGHT_SAMPLES)[:, None] % 2, 0.5, 1.0)
    return KEY_DIRECTION + radius * (np.cos(angle) * side + np.sin(angle) * other)


def _edges(colour: Float64[np.ndarray, "h w 3"], geom: Int32[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """Pixels that differ from a neighbour in geom or clearly in colour."""
    is_edge = np.zeros(geom.shape, dtype=bool)
    for axis in (0, 1):
        near, far = np.diff(geom, axis=axis) != 0, np.abs(np.diff(colour, axis=axis)).max(axis=-1) > 0.04
        differs = near | far
        lower = [slice(None)] * 2
        upper = [slice(None)] * 2
        lower[axis], upper[axis] = slice(None, -1), slice(1, None)
        is_edge[tuple(lower)] |= differs
        is_edge[tuple(upper)] |= differs
    return is_edge


def _group_mask(groups: tuple[int, ...]) -> UInt8[np.ndarray, "6"]:
    return np.array([group in groups for group in range(mujoco.mjNGROUP)], dtype=np.uint8)
