"""A live view in MuJoCo's own viewer; needs a display."""

import sys
import threading
import warnings
from collections.abc import Mapping, Sequence
from queue import SimpleQueue
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from clutter6d.assets.asset import Asset
from clutter6d.errors import MissingDependencyError
from clutter6d.play.live_view import Action, drain, has_display
from clutter6d.render.camera import EPISODE_VIEW
from clutter6d.render.scene_picture import picture_model
from clutter6d.render.studio import SHOWN_GROUPS
from clutter6d.scene import Scene

POINT_RADIUS_M = 0.003
MAX_POINTS = 8192
CLOSING_S = 10.0
_GLFW_KEYS = {
    "space": 32, "enter": 257, "backspace": 259, "home": 268, "end": 269, "pageup": 266, "pagedown": 267,
    "arrowright": 262, "arrowleft": 263, "arrowdown": 264, "arrowup": 265,
}  # fmt: skip


class NativeView:
    """A window that shows one scene at a time; it is opened anew for each.

    Raises:
        MissingDependencyError: There is no display, or no window can be opened on it.
    """

    def __init__(self) -> None:
        _check_display()
        self._names: dict[int, str] = {}
        self._keys: SimpleQueue[int] = SimpleQueue()
        self._help, self._text = "", ("", "")
        self._window: Any = None
        self._threads: tuple[threading.Thread, ...] = ()
        self._data: mujoco.MjData | None = None

    @property
    def is_open(self) -> bool:
        """Whether the person has not closed the window."""
        return self._window is None or self._window.is_running()

    @property
    def is_watched(self) -> bool:
        """Whether the window is there."""
        return self.is_open

    def offer(self, actions: Sequence[Action]) -> None:
        """A key for each action, listed in the window."""
        self._names = {_GLFW_KEYS.get(action.key, ord(action.key[0])): action.name for action in actions}
        self._help = "\n".join(f"{action.key}: {action.label}" for action in actions)

    def triggered(self) -> tuple[str, ...]:
        """Names of the actions asked for since the last call."""
        return tuple(self._names[key] for key in drain(self._keys) if key in self._names)

    def show(self, scene: Scene, assets: Mapping[str, Asset], pair: int = 0) -> None:
        """Show a goal pair of a scene at its start, in a new window."""
        import mujoco.viewer  # it opens a connection to the window system

        self.close()
        picture = picture_model(scene, assets, pair)
        picture.model.vis.global_.fovy = EPISODE_VIEW.vertical_fov_deg
        data = self._data = mujoco.MjData(picture.model)
        data.qpos[:] = picture.initial_qpos
        before = threading.enumerate()
        self._window = mujoco.viewer.launch_passive(
            picture.model, data, key_callback=self._keys.put, show_left_ui=False, show_right_ui=False
        )
        self._threads = tuple(thread for thread in threading.enumerate() if thread not in before)
        with self._window.lock():
            self._window.opt.geomgroup[:] = [group in SHOWN_GROUPS for group in range(6)]
            camera = self._window.cam
            camera.lookat[:], camera.distance = EPISODE_VIEW.look_at_m, EPISODE_VIEW.distance_m
            camera.azimuth, camera.elevation = EPISODE_VIEW.azimuth_deg, EPISODE_VIEW.elevation_deg
        self._window.sync()

    def update(self, qpos: Float64[np.ndarray, "nq"]) -> None:
        """Move everything to a configuration."""
        assert self._data is not None, "show a scene first"
        with self._window.lock():
            self._data.qpos[:] = qpos
            mujoco.mj_forward(self._data.model, self._data)
        self._window.sync()

    def draw_points(self, points: Float32[np.ndarray, "point 3"], rgb: UInt8[np.ndarray, "point 3"]) -> None:
        """Draw points as small balls, at most 8,192, instead of those drawn before."""
        with self._window.lock():
            drawn = self._window.user_scn
            drawn.ngeom = min(len(points), MAX_POINTS, drawn.maxgeom)
            for index in range(drawn.ngeom):
                rgba = np.append(rgb[index] / 255, 1).astype(np.float32)
                size, turn = np.full(3, POINT_RADIUS_M), np.eye(3).ravel()
                mujoco.mjv_initGeom(
                    drawn.geoms[index], mujoco.mjtGeom.mjGEOM_SPHERE, size, points[index].astype(np.float64), turn, rgba
                )

    def message(self, text: str) -> None:
        """Show lines of text in the window's corner, the keys in another."""
        if self._window is None:
            return
        lines = [line.partition("\t") for line in text.splitlines()]
        labels, values = "\n".join(line[0] for line in lines), "\n".join(line[2] for line in lines)
        grid, font = mujoco.mjtGridPos, mujoco.mjtFontScale.mjFONTSCALE_150
        self._window.set_texts(
            [(font, grid.mjGRID_TOPLEFT, labels, values), (font, grid.mjGRID_BOTTOMLEFT, self._help, "")]
        )

    def close(self) -> None:
        """Close the window and wait until it is gone."""
        if self._window is not None:
            self._window.close()
            self._window = None
        for thread in self._threads:
            thread.join(CLOSING_S)  # a window that still draws when Python ends takes it down
        self._threads = ()


def _check_display() -> None:
    """Find out whether a window can be opened; MuJoCo's viewer would wait for ever for one that cannot."""
    if not has_display():
        raise MissingDependencyError(
            "the native viewer needs a display and none is set (DISPLAY, WAYLAND_DISPLAY); use: --viewer web"
        )
    if sys.platform == "darwin":
        return  # there the window belongs to mjpython, which says so itself
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        window = None
        if glfw.init():
            glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
            window = glfw.create_window(16, 16, "clutter6d", None, None)
            glfw.default_window_hints()
    if not window:
        raise MissingDependencyError("no window can be opened on this display; use: --viewer web")
    glfw.destroy_window(window)
