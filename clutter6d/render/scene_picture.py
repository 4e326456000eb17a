"""Pictures of scenes: the model to draw, stills of a goal pair, and a turn around it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from jaxtyping import Float64

from clutter6d.assets.asset import Asset
from clutter6d.assets.mujoco_body import add_ghost_geoms
from clutter6d.errors import InvalidValueError
from clutter6d.geometry import Pose
from clutter6d.render.camera import SCENE_VIEW, TABLE_VIEW, Camera
from clutter6d.render.picture import Image, open_renderer
from clutter6d.render.studio import GHOST_GROUP, add_studio
from clutter6d.scene import Scene
from clutter6d.sim.scene_model import build_scene_spec, joint_state

GHOST_RGBA = (0.20, 0.78, 0.36, 0.50)
TURN_DEG = 50.0


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PictureModel:
    """A scene as it is drawn, with the goal of one pair as a ghost.

    Attributes:
        model: Robot, table, objects with their visual meshes, ghost and surroundings; not for simulation.
        initial_qpos: The pair's start: arm at home, objects at their poses. Its layout is the simulator's, so that
            recorded configurations can be drawn with this model.
    """

    model: mujoco.MjModel
    initial_qpos: Float64[np.ndarray, "nq"]


def picture_model(scene: Scene, assets: Mapping[str, Asset], pair: int = 0) -> PictureModel:
    """The model that shows one goal pair of a scene.

    Args:
        scene: The scene.
        assets: Its assets by content hash.
        pair: Index of the goal pair.

    Raises:
        InvalidValueError: The scene has no such pair.
    """
    if not 0 <= pair < len(scene.goal_pairs):
        raise InvalidValueError(f"scene {scene.scene_id} has goal pairs 0 to {len(scene.goal_pairs) - 1}, not {pair}")
    objects = [(item.name, assets[item.asset_hash]) for item in scene.objects]
    spec = build_scene_spec(objects, visuals=True)
    add_studio(spec)
    add_goal_ghost(spec, objects[0][0], objects[0][1], scene.goal_pairs[pair].goal)
    qpos = joint_state(scene.goal_pairs[pair].object_poses)
    return PictureModel(model=spec.compile(), initial_qpos=np.asarray(qpos, dtype=np.float64))


def add_goal_ghost(spec: mujoco.MjSpec, target: str, asset: Asset, goal: Pose) -> None:
    """Show the target, whose visual meshes the specification has, translucent at its goal."""
    ghost = spec.worldbody.add_body(name=f"{target}_goal", pos=goal.position, quat=goal.quat_wxyz)
    add_ghost_geoms(ghost, asset, name=target, rgba=GHOST_RGBA, group=GHOST_GROUP)


def render_scene(
    scene: Scene,
    assets: Mapping[str, Asset],
    pair: int = 0,
    *,
    cameras: tuple[Camera, ...] = (SCENE_VIEW, TABLE_VIEW),
    width: int = 960,
    height: int = 720,
    backend: str = "auto",
) -> tuple[Image, ...]:
    """Stills of the start of one goal pair, one for each camera."""
    shown = picture_model(scene, assets, pair)
    with open_renderer(shown.model, width=width, height=height, backend=backend) as renderer:
        return tuple(renderer.draw(shown.initial_qpos, camera) for camera in cameras)


def render_turn(
    scene: Scene,
    assets: Mapping[str, Asset],
    pair: int = 0,
    *,
    frames: int = 60,
    width: int = 960,
    height: int = 720,
    backend: str = "auto",
) -> Iterator[Image]:
    """Frames of the camera swinging to and fro in front of the start of one goal pair, for a video that loops."""
    shown = picture_model(scene, assets, pair)
    with open_renderer(shown.model, width=width, height=height, backend=backend) as renderer:
        for phase in np.linspace(0, 2 * np.pi, frames, endpoint=False):
            azimuth = SCENE_VIEW.azimuth_deg + TURN_DEG * (1 - float(np.cos(phase))) / 2
            yield renderer.draw(shown.initial_qpos, replace(SCENE_VIEW, azimuth_deg=azimuth))
