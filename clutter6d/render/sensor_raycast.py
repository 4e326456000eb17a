"""What a camera measures, by ray casting: for machines without OpenGL, and to check what OpenGL says."""

import numpy as np
from jaxtyping import Float32, Float64, UInt8

from clutter6d.render.camera import Camera
from clutter6d.render.raycast import RaycastRenderer
from clutter6d.render.sensor_model import BACKGROUND, SensorModel
from clutter6d.render.sensor_opengl import MAX_RANGE_M
from clutter6d.render.studio import SHOWN_GROUPS


class RaycastSensors:
    """Cameras that look at one scene.

    Args:
        shown: The scene.
    """

    def __init__(self, shown: SensorModel) -> None:
        self.shown = shown
        self._renderers: dict[tuple[int, int], RaycastRenderer] = {}
        self._qpos = shown.model.qpos0

    def place(self, qpos: Float64[np.ndarray, "nq"], table_height_m: float) -> None:
        """Bring the scene to a configuration."""
        if self.shown.raise_table(table_height_m):
            self._renderers.clear()  # they hold the model as it was
        self._qpos = qpos

    def draw(self, camera: Camera, width: int, height: int) -> UInt8[np.ndarray, "height width 3"]:
        """Colours."""
        return self._renderer(width, height).draw(self._qpos, camera)

    def measure(
        self, camera: Camera, width: int, height: int
    ) -> tuple[Float32[np.ndarray, "height width"], UInt8[np.ndarray, "height width"]]:
        """Depth along the optical axis [m], 0 where there is none, and labels."""
        depth, geom = self._renderer(width, height).measure(self._qpos, camera)
        is_near = (geom >= 0) & (depth < MAX_RANGE_M)
        labels = np.where(geom >= 0, self.shown.labels[geom], BACKGROUND).astype(np.uint8)
        return np.where(is_near, depth, 0.0).astype(np.float32), labels

    def close(self) -> None:
        """Nothing is held; here for likeness with the OpenGL sensors."""

    def _renderer(self, width: int, height: int) -> RaycastRenderer:
        size = (width, height)
        if size not in self._renderers:
            self._renderers[size] = RaycastRenderer(self.shown.model, width, height, SHOWN_GROUPS)
        return self._renderers[size]
