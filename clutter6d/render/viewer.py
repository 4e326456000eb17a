"""MuJoCo's interactive viewer on a scene."""

import os
import sys

from clutter6d.errors import MissingDependencyError
from clutter6d.render.scene_picture import PictureModel
from clutter6d.sim.robot import HOME_QPOS


def open_viewer(shown: PictureModel) -> None:
    """Open the viewer and run the scene in it until the window is closed.

    Raises:
        MissingDependencyError: There is no display.
    """
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise MissingDependencyError(
            "the viewer needs a display and none is set (DISPLAY, WAYLAND_DISPLAY); use: clutter6d render"
        )
    import mujoco.viewer  # it opens a connection to the window system

    data = mujoco.MjData(shown.model)
    data.qpos[:] = shown.initial_qpos
    data.ctrl[:] = HOME_QPOS
    mujoco.mj_forward(shown.model, data)
    mujoco.viewer.launch(shown.model, data)
