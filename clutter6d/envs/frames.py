"""Pictures of environments, for ``render()``."""

from collections import OrderedDict
from contextlib import ExitStack

import numpy as np
from jaxtyping import Float64

from clutter6d.envs.tasks import Task
from clutter6d.render.camera import EPISODE_VIEW
from clutter6d.render.picture import Image, Renderer, open_renderer
from clutter6d.render.scene_picture import picture_model

MAX_OPEN = 8


class FrameRenderer:
    """Draws tasks with the goal as a ghost; renderers of the tasks drawn last stay open.

    Args:
        width: Of the pictures [px].
        height: Of the pictures [px].
    """

    def __init__(self, width: int = 640, height: int = 480) -> None:
        self._width, self._height = width, height
        self._open: OrderedDict[tuple[str, int], tuple[Renderer, ExitStack]] = OrderedDict()

    def draw(self, task: Task, qpos: Float64[np.ndarray, "nq"]) -> Image:
        """The picture of one configuration, laid out as the simulator's."""
        key = task.scene.scene_id, task.pair_index
        if key not in self._open:
            if len(self._open) >= MAX_OPEN:
                self._open.popitem(last=False)[1][1].close()
            shown, stack = picture_model(task.scene, task.assets, task.pair_index), ExitStack()
            self._open[key] = (
                stack.enter_context(open_renderer(shown.model, width=self._width, height=self._height)),
                stack,
            )
        self._open.move_to_end(key)
        return self._open[key][0].draw(qpos, EPISODE_VIEW)

    def close(self) -> None:
        """Free the graphics contexts."""
        while self._open:
            self._open.popitem()[1][1].close()
