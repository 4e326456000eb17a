"""One door to drawing: pictures of a model, by whichever renderer the machine has."""

from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from typing import Protocol

import mujoco
import numpy as np
from jaxtyping import Float, Float64, UInt8

from clutter6d.errors import InvalidValueError
from clutter6d.physics import COLLISION_GROUP, VISUAL_GROUP
from clutter6d.render.backend import choose_backend
from clutter6d.render.camera import SCENE_VIEW, Camera
from clutter6d.render.opengl import OpenGlRenderer
from clutter6d.render.raycast import RaycastRenderer
from clutter6d.render.studio import SHOWN_GROUPS

Image = UInt8[np.ndarray, "height width 3"]
MAX_PIXELS = 1 << 24


class Renderer(Protocol):
    """Draws configurations of one model."""

    def draw(self, qpos: Float64[np.ndarray, "nq"], camera: Camera) -> Image:
        """The picture of one configuration."""
        ...


@contextmanager
def open_renderer(
    model: mujoco.MjModel, *, width: int = 960, height: int = 720, backend: str = "auto"
) -> Generator[Renderer]:
    """A renderer for many pictures of one model; what it holds is freed at the end.

    Shows the visual geometry where the model has any, else the collision geometry.

    Args:
        model: The model; it is not changed.
        width: Of the pictures [px].
        height: Of the pictures [px].
        backend: ``auto``, ``egl``, ``osmesa`` or ``raycast``; see :func:`choose_backend`.

    Raises:
        InvalidValueError: The size is not positive or too large.
        UnknownNameError: There is no such backend.
        MissingDependencyError: The backend does not work on this machine.
    """
    if width < 1 or height < 1 or width * height > MAX_PIXELS:
        raise InvalidValueError(f"picture of {width} x {height} pixels: give positive sizes of at most {MAX_PIXELS:,}")
    is_collision_only = not (model.geom_group == VISUAL_GROUP).any()
    groups = (*SHOWN_GROUPS, COLLISION_GROUP) if is_collision_only else SHOWN_GROUPS
    chosen = choose_backend(backend)
    if chosen == "raycast":
        yield RaycastRenderer(model, width, height, groups)
        return
    with OpenGlRenderer(model, width, height, chosen, groups) as renderer:
        yield renderer


def render_model(
    model: mujoco.MjModel,
    qpos: Float[np.ndarray, "nq"],
    camera: Camera = SCENE_VIEW,
    *,
    width: int = 960,
    height: int = 720,
    backend: str = "auto",
) -> Image:
    """One picture of a model; arguments and errors as for :func:`open_renderer`."""
    with open_renderer(model, width=width, height=height, backend=backend) as renderer:
        return renderer.draw(np.asarray(qpos, dtype=np.float64), camera)


def render_rollout(
    model: mujoco.MjModel,
    qpos_sequence: Iterable[Float[np.ndarray, "nq"]],
    camera: Camera = SCENE_VIEW,
    *,
    width: int = 960,
    height: int = 720,
    backend: str = "auto",
) -> Iterator[Image]:
    """Pictures of a sequence of configurations, one at a time, for a video.

    Args:
        model: The model, for instance of :func:`clutter6d.render.scene_picture.picture_model`.
        qpos_sequence: One configuration a frame.
        camera: Where from.
        width: Of the pictures [px].
        height: Of the pictures [px].
        backend: As for :func:`open_renderer`.

    Yields:
        The frames.
    """
    with open_renderer(model, width=width, height=height, backend=backend) as renderer:
        for qpos in qpos_sequence:
            yield renderer.draw(np.asarray(qpos, dtype=np.float64), camera)
