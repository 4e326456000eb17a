"""The cameras of a recording, and the pictures they take of a rollout."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from clutter6d.envs.cameras import DEFAULT_CAMERAS, CameraConfig, CameraRig, entry
from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.recording.rollout import Rollout
from clutter6d.render.camera import EPISODE_VIEW, SCENE_VIEW, TABLE_VIEW, Camera
from clutter6d.render.picture import Image
from clutter6d.sim.scene_model import SceneModel

VIEWS: Final[Mapping[str, Camera]] = {"episode": EPISODE_VIEW, "scene": SCENE_VIEW, "table": TABLE_VIEW}
SENSORS: Final[Mapping[str, Camera]] = {sensor.name: sensor.camera for sensor in DEFAULT_CAMERAS}
CAMERAS: Final[Mapping[str, Camera]] = {**SENSORS, **VIEWS}
"""Cameras by name: those of the observation, and the views that pictures of scenes are drawn from."""


def find_cameras(names: Sequence[str]) -> tuple[str, ...]:
    """Names of cameras, checked.

    Raises:
        UnknownNameError: There is no such camera.
        InvalidValueError: One is named twice.
    """
    unknown = next((name for name in names if name not in CAMERAS), None)
    if unknown is not None:
        raise UnknownNameError("camera", unknown, CAMERAS)
    if len(set(names)) < len(names):
        raise InvalidValueError(f"cameras {','.join(names)}: name each once")
    return tuple(names)


def take_pictures(
    rollout: Rollout, model: SceneModel, camera: str, *, width: int, height: int, backend: str = "auto"
) -> Iterator[Image]:
    """What a camera saw before each action, as cameras of the observation see it: without the goal, without shadows.

    Args:
        rollout: The episode.
        model: Its scene.
        camera: Name of the camera.
        width: Of the pictures [px].
        height: Of the pictures [px].
        backend: Which renderer; see :func:`clutter6d.render.backend.choose_backend`.
    """
    config = CameraConfig(name=camera, camera=CAMERAS[camera], width=width, height=height, kinds=("rgb",))
    with CameraRig([config], backend=backend, kept_scenes=1) as rig:
        for qpos in rollout.states.qpos()[:-1]:
            yield rig.observe([model], qpos[None])[entry(config, "rgb")][0]
