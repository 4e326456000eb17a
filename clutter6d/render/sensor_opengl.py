"""What a camera measures, by OpenGL: colour smoothed at edges; depth and labels of single points, never averaged."""

import importlib
from typing import Final

import mujoco
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from clutter6d.render.backend import GlBackend
from clutter6d.render.camera import Camera
from clutter6d.render.opengl import MAX_GEOMS, SUPERSAMPLING
from clutter6d.render.sensor_model import BACKGROUND, SensorModel
from clutter6d.render.studio import SHOWN_GROUPS

MAX_RANGE_M: Final = 10.0
"""Depths beyond are given as 0: nothing measured."""


class GraphicsContext:
    """One OpenGL context, in which the buffers of many scenes live.

    Args:
        backend: Which to make.
    """

    def __init__(self, backend: GlBackend) -> None:
        self._context = importlib.import_module(f"mujoco.{backend}").GLContext(64, 64)

    def make_current(self) -> None:
        """Direct what is drawn next to it."""
        self._context.make_current()

    def close(self) -> None:
        """Free it, after everything in it."""
        self._context.free()


class OpenGlSensors:
    """Cameras that look at one scene.

    Args:
        shown: The scene.
        context: Where to draw.
        width: Of the largest picture [px].
        height: Of the largest picture [px].
    """

    def __init__(self, shown: SensorModel, context: GraphicsContext, width: int, height: int) -> None:
        self.shown, self._context = shown, context
        self._data = mujoco.MjData(shown.model)
        context.make_current()
        size, quality = shown.model.vis.global_, shown.model.vis.quality
        size.offwidth, size.offheight, quality.offsamples = SUPERSAMPLING * width, SUPERSAMPLING * height, 0
        self._buffers = mujoco.MjrContext(shown.model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        self._buffers.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        self._scene = mujoco.MjvScene(shown.model, maxgeom=MAX_GEOMS)
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = [group in SHOWN_GROUPS for group in range(mujoco.mjNGROUP)]
        self._labels = np.empty(0, dtype=np.uint8)

    def place(self, qpos: Float64[np.ndarray, "nq"], table_height_m: float) -> None:
        """Bring the scene to a configuration."""
        self.shown.raise_table(table_height_m)
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self.shown.model, self._data)
        mujoco.mj_camlight(self.shown.model, self._data)

    def draw(self, camera: Camera, width: int, height: int) -> UInt8[np.ndarray, "height width 3"]:
        """Colours."""
        rect = mujoco.MjrRect(0, 0, SUPERSAMPLING * width, SUPERSAMPLING * height)
        colours = np.empty((rect.height, rect.width, 3), dtype=np.uint8)
        self._render(camera, rect, is_segmented=False)
        mujoco.mjr_readPixels(colours, None, rect, self._buffers)
        blocks = (height, SUPERSAMPLING, width, SUPERSAMPLING, 3)
        return np.rint(colours[::-1].reshape(blocks).mean(axis=(1, 3))).astype(np.uint8)

    def measure(
        self, camera: Camera, width: int, height: int
    ) -> tuple[Float32[np.ndarray, "height width"], UInt8[np.ndarray, "height width"]]:
        """Depth along the optical axis [m], 0 where there is none, and labels."""
        rect = mujoco.MjrRect(0, 0, width, height)
        colours, depth = np.empty((height, width, 3), dtype=np.uint8), np.empty((height, width), dtype=np.float32)
        self._render(camera, rect, is_segmented=True)
        mujoco.mjr_readPixels(colours, depth, rect, self._buffers)
        segments = colours.astype(np.uint32) @ np.array([1, 1 << 8, 1 << 16], dtype=np.uint32)
        return _metres(depth[::-1], self.shown.model), self._label_of_segments()[segments[::-1]]

    def close(self) -> None:
        """Free the buffers; the object cannot be used afterwards."""
        self._context.make_current()
        self._buffers.free()

    def _render(self, camera: Camera, rect: mujoco.MjrRect, *, is_segmented: bool) -> None:
        view, model = mujoco.MjvCamera(), self.shown.model
        view.lookat[:], view.distance = camera.look_at_m, camera.distance_m
        view.azimuth, view.elevation = camera.azimuth_deg, camera.elevation_deg
        model.vis.global_.fovy = camera.vertical_fov_deg
        for flag in (mujoco.mjtRndFlag.mjRND_SEGMENT, mujoco.mjtRndFlag.mjRND_IDCOLOR):
            self._scene.flags[flag] = is_segmented
        self._context.make_current()
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._buffers)
        every = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(model, self._data, self._option, None, view, every, self._scene)
        mujoco.mjr_render(rect, self._scene, self._buffers)

    def _label_of_segments(self) -> UInt8[np.ndarray, "segment"]:
        """Label by segment number, 0 for none; which geom has which number depends on the model alone."""
        if not len(self._labels):
            drawn = self._scene.geoms[: self._scene.ngeom]
            self._labels = np.full(self._scene.ngeom + 1, BACKGROUND, dtype=np.uint8)
            for item in drawn:
                if item.segid >= 0 and item.objtype == mujoco.mjtObj.mjOBJ_GEOM:
                    self._labels[item.segid + 1] = self.shown.labels[item.objid]
        return self._labels


def _metres(depth: Float32[np.ndarray, "height width"], model: mujoco.MjModel) -> Float32[np.ndarray, "height width"]:
    """Depth from a buffer in which 1 is the near plane and 0 the far one, hyperbolic between."""
    near, far = (plane * model.stat.extent for plane in (model.vis.map.znear, model.vis.map.zfar))
    metres = near * far / (near + depth.astype(np.float64) * (far - near))
    return np.where(metres < MAX_RANGE_M, metres, 0.0).astype(np.float32)
