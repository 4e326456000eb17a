"""Cameras as part of an observation: colour, depth and segmentation of what is really simulated.

The paper's robot has three RealSense cameras around its table and does not say where; :data:`DEFAULT_CAMERAS` stand in
front of the robot and at both sides, with the vertical angle of view of that camera's colour sensor.
"""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Final

import numpy as np
from gymnasium.spaces import Box
from jaxtyping import Float64

from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.geometry import Pose
from clutter6d.render.backend import choose_backend
from clutter6d.render.camera import Camera
from clutter6d.render.sensor_model import make_sensor_model
from clutter6d.render.sensor_opengl import MAX_RANGE_M, GraphicsContext, OpenGlSensors
from clutter6d.render.sensor_raycast import RaycastSensors
from clutter6d.sim.model_variation import table_height_m
from clutter6d.sim.scene_model import SceneModel

CAMERA_KINDS: Final = ("rgb", "depth", "segmentation")
_MAX_SIDE_PX: Final = 2048
_REALSENSE_FOV_DEG: Final = 42.0


@dataclass(frozen=True, kw_only=True, slots=True)
class CameraConfig:
    """One camera and what it gives.

    Attributes:
        name: Its entries in the observation are ``camera_{name}_rgb``, ``_depth`` and ``_segmentation``.
        camera: Where it stands, world frame.
        width: Of its pictures [px].
        height: Of its pictures [px].
        kinds: What it gives. ``rgb``: ``(height, width, 3)`` uint8. ``depth``: ``(height, width)`` float32, metres
            along the optical axis, 0 where nothing is within 10 m. ``segmentation``: ``(height, width)`` uint8; 0
            background, 1 table, 2 robot, 3 target, 4 and up the obstacles in the scene's order.
    """

    name: str
    camera: Camera
    width: int = 128
    height: int = 96
    kinds: tuple[str, ...] = CAMERA_KINDS

    def __post_init__(self) -> None:
        """Refuse a camera without name, size or use."""
        if not self.name.isidentifier():
            raise InvalidValueError(f"camera name '{self.name}': use letters, digits and underscores, as in 'front'")
        if not (1 <= self.width <= _MAX_SIDE_PX and 1 <= self.height <= _MAX_SIDE_PX):
            raise InvalidValueError(
                f"camera '{self.name}' of {self.width} x {self.height} pixels: give sides of 1 to {_MAX_SIDE_PX}"
            )
        for kind in self.kinds:
            if kind not in CAMERA_KINDS:
                raise UnknownNameError("kind of picture", kind, CAMERA_KINDS)
        if not self.kinds or len(set(self.kinds)) < len(self.kinds):
            raise InvalidValueError(f"camera '{self.name}': give at least one kind of picture, each once")

    def intrinsics(self) -> Float64[np.ndarray, "3 3"]:
        """The camera matrix [px]; the centre of the first pixel is (0, 0), as OpenCV has it."""
        return self.camera.intrinsics(self.width, self.height)

    def pose_camera_to_world(self) -> Pose:
        """Pose of the camera's frame: x right, y down, z along the view."""
        return self.camera.pose_camera_to_world()

    def space(self, kind: str) -> Box:
        """What the pictures of one kind may be."""
        shape = (self.height, self.width)
        if kind == "rgb":
            return Box(0, 255, (*shape, 3), np.uint8)
        return Box(0, MAX_RANGE_M, shape, np.float32) if kind == "depth" else Box(0, 255, shape, np.uint8)


def _around(name: str, azimuth_deg: float) -> CameraConfig:
    camera = Camera(
        look_at_m=(-0.03, 0.0, 0.04),
        distance_m=1.05,
        azimuth_deg=azimuth_deg,
        elevation_deg=-42.0,
        vertical_fov_deg=_REALSENSE_FOV_DEG,
    )
    return CameraConfig(name=name, camera=camera)


DEFAULT_CAMERAS: Final = (_around("front", 180.0), _around("left", 250.0), _around("right", 110.0))
"""Facing the robot at (0.75, 0, 0.74) m, at its left at (0.24, 0.73, 0.74) m, and at its right. Of the objects in the
dense test scenes, each sees 99% at the start, and at least one sees each whole, but for what hides it."""


def camera_spaces(cameras: Sequence[CameraConfig]) -> dict[str, Box]:
    """The observation's entries that cameras add, with their spaces.

    Raises:
        InvalidValueError: Two cameras have the same name.
    """
    if len({camera.name for camera in cameras}) < len(cameras):
        raise InvalidValueError("two cameras have the same name; name each differently")
    return {entry(camera, kind): camera.space(kind) for camera in cameras for kind in camera.kinds}


def entry(camera: CameraConfig, kind: str) -> str:
    """Name of an entry in the observation."""
    return f"camera_{camera.name}_{kind}"


class CameraRig:
    """Draws what cameras see of the scenes of many slots; a context manager, since it may hold a graphics context.

    Args:
        cameras: The cameras; the same for all slots.
        backend: ``auto``, ``egl``, ``osmesa`` or ``raycast``; see :func:`clutter6d.render.backend.choose_backend`.
        kept_scenes: Scenes kept ready to be drawn; those not drawn for longest are forgotten first. A scene takes
            about 10 MB; give at least the number of slots where each has its own.

    Raises:
        InvalidValueError: Two cameras have the same name, there is none, or no scene may be kept.
        UnknownNameError: There is no such backend.
        MissingDependencyError: The backend does not work on this machine.
    """

    def __init__(
        self, cameras: Sequence[CameraConfig] = DEFAULT_CAMERAS, *, backend: str = "auto", kept_scenes: int = 64
    ) -> None:
        if not cameras or kept_scenes < 1:
            raise InvalidValueError(
                f"{len(cameras)} cameras, {kept_scenes} kept scenes; at least one of each is needed"
            )
        self.cameras, self.spaces = tuple(cameras), camera_spaces(cameras)
        self.backend = choose_backend(backend)
        self._context = None if self.backend == "raycast" else GraphicsContext(self.backend)
        self._kept_scenes = kept_scenes
        self._sensors: OrderedDict[tuple[str, ...], OpenGlSensors | RaycastSensors] = OrderedDict()

    def observe(self, scenes: Sequence[SceneModel], qpos: Float64[np.ndarray, "slot nq"]) -> dict[str, np.ndarray]:
        """The entries of :func:`camera_spaces`, one row a slot.

        Args:
            scenes: What each slot simulates; the table is drawn at the height that the model has.
            qpos: Configuration of each slot, as in :func:`clutter6d.sim.scene_model.joint_state`.
        """
        seen = {name: np.empty((len(scenes), *space.shape), dtype=space.dtype) for name, space in self.spaces.items()}
        for slot, scene in enumerate(scenes):
            sensors = self._sensors_of(scene)
            sensors.place(qpos[slot], table_height_m(scene.model))
            for camera in self.cameras:
                for kind, picture in _take(sensors, camera).items():
                    seen[entry(camera, kind)][slot] = picture
        return seen

    def close(self) -> None:
        """Free what is held; the object cannot be used afterwards."""
        for sensors in self._sensors.values():
            sensors.close()
        self._sensors.clear()
        if self._context is not None:
            self._context.close()

    def __enter__(self) -> "CameraRig":
        """Enter."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Free what is held."""
        self.close()

    def _sensors_of(self, scene: SceneModel) -> OpenGlSensors | RaycastSensors:
        key = (*scene.names, *(asset.content_hash for asset in scene.assets))
        if key not in self._sensors:
            if len(self._sensors) >= self._kept_scenes:
                self._sensors.popitem(last=False)[1].close()
            self._sensors[key] = self._make_sensors(scene)
        self._sensors.move_to_end(key)
        return self._sensors[key]

    def _make_sensors(self, scene: SceneModel) -> OpenGlSensors | RaycastSensors:
        shown = make_sensor_model(list(zip(scene.names, scene.assets, strict=True)))
        if self._context is None:
            return RaycastSensors(shown)
        width, height = (max(getattr(camera, side) for camera in self.cameras) for side in ("width", "height"))
        return OpenGlSensors(shown, self._context, width, height)


def _take(sensors: OpenGlSensors | RaycastSensors, camera: CameraConfig) -> dict[str, np.ndarray]:
    """The kinds of picture that a camera gives, each drawn once."""
    taken: dict[str, np.ndarray] = {}
    if "rgb" in camera.kinds:
        taken["rgb"] = sensors.draw(camera.camera, camera.width, camera.height)
    if "depth" in camera.kinds or "segmentation" in camera.kinds:
        depth, labels = sensors.measure(camera.camera, camera.width, camera.height)
        taken |= {"depth": depth, "segmentation": labels}
    return {kind: taken[kind] for kind in camera.kinds}
