"""Drawing with MuJoCo's OpenGL renderer into a context that was made for the purpose.

``mujoco.Renderer`` takes its context from ``MUJOCO_GL`` as it was when ``mujoco`` was imported; here the context is
named, so that a process may decide late.
"""

import atexit
import importlib
from contextlib import ExitStack
from types import TracebackType

import mujoco
import numpy as np
from jaxtyping import Float64, UInt8

from clutter6d.render.backend import GlBackend
from clutter6d.render.camera import Camera

MAX_GEOMS = 10_000
SUPERSAMPLING = 2
"""Pictures are drawn larger by this factor and averaged: smoother than multisampling, shadows too, and as fast."""


class OpenGlRenderer:
    """Draws one model; a context manager, since it holds a graphics context.

    Args:
        model: The model; it is not changed.
        width: Of the picture [px].
        height: Of the picture [px].
        backend: Which context to make.
        geom_groups: Which groups of geoms are shown.
    """

    def __init__(
        self, model: mujoco.MjModel, width: int, height: int, backend: GlBackend, geom_groups: tuple[int, ...]
    ) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        self._rect = mujoco.MjrRect(0, 0, SUPERSAMPLING * width, SUPERSAMPLING * height)
        self._context = importlib.import_module(f"mujoco.{backend}").GLContext(self._rect.width, self._rect.height)
        self._held = ExitStack()  # so that closing frees what there is, even if making the rest was interrupted
        self._held.callback(self._context.free)
        atexit.register(self.close)  # after the graphics library's own, so that it runs before the library shuts down
        self._context.make_current()
        self._buffers = self._sized_buffers()
        self._held.callback(self._buffers.free)
        self._held.callback(self._context.make_current)  # what is pushed last is called first
        self._scene = mujoco.MjvScene(model, maxgeom=MAX_GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = True
        self._scene.flags[mujoco.mjtRndFlag.mjRND_HAZE] = False
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = [group in geom_groups for group in range(mujoco.mjNGROUP)]

    def _sized_buffers(self) -> mujoco.MjrContext:
        size, quality = self._model.vis.global_, self._model.vis.quality
        kept = size.offwidth, size.offheight, quality.offsamples
        size.offwidth, size.offheight, quality.offsamples = self._rect.width, self._rect.height, 0
        try:
            buffers = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        finally:
            size.offwidth, size.offheight, quality.offsamples = kept
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, buffers)
        return buffers

    def draw(self, qpos: Float64[np.ndarray, "nq"], camera: Camera) -> UInt8[np.ndarray, "height width 3"]:
        """The picture of one configuration."""
        self._context.make_current()
        self._data.qpos[:] = qpos
        mujoco.mj_forward(self._model, self._data)
        view = mujoco.MjvCamera()
        view.lookat[:], view.distance = camera.look_at_m, camera.distance_m
        view.azimuth, view.elevation = camera.azimuth_deg, camera.elevation_deg
        field = self._model.vis.global_
        kept = field.fovy
        field.fovy = camera.vertical_fov_deg
        try:
            every = mujoco.mjtCatBit.mjCAT_ALL.value
            mujoco.mjv_updateScene(self._model, self._data, self._option, None, view, every, self._scene)
        finally:
            field.fovy = kept
        mujoco.mjr_render(self._rect, self._scene, self._buffers)
        picture = np.empty((self._rect.height, self._rect.width, 3), dtype=np.uint8)
        mujoco.mjr_readPixels(picture, None, self._rect, self._buffers)
        blocks = (
            self._rect.height // SUPERSAMPLING,
            SUPERSAMPLING,
            self._rect.width // SUPERSAMPLING,
            SUPERSAMPLING,
            3,
        )
        return np.rint(picture[::-1].reshape(blocks).mean(axis=(1, 3))).astype(np.uint8)

    def close(self) -> None:
        """Free the graphics context; the object cannot be used afterwards."""
        atexit.unregister(self.close)
        self._held.close()

    def __enter__(self) -> "OpenGlRenderer":
        """Enter."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Free the graphics context."""
        self.close()
