"""A scene as MJCF: one folder that MuJoCo's own viewer opens, with no code of this project.

scene.xml       robot, table, objects with visual and collision geometry, the goal as a translucent ghost, and one
keyframe for each goal pair; meshes are inline, and numbers are exact
LICENCES.csv    terms, author and origin of every object
"""

from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from clutter6d.assets.asset import Asset
from clutter6d.assets.mujoco_body import add_ghost_geoms
from clutter6d.export.exact_xml import exact_xml
from clutter6d.export.licences import licence_table
from clutter6d.physics import VISUAL_GROUP
from clutter6d.scene import Scene
from clutter6d.schema import write_bytes
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.scene_model import build_scene_spec, joint_state

GHOST = "goal"
GHOST_RGB = (0.25, 0.80, 0.35)
GHOST_OPACITY = 0.35


def scene_spec(scene: Scene, assets: Mapping[str, Asset]) -> mujoco.MjSpec:
    """A scene with everything to look at: visuals, lights, the goal's ghost, and keyframes ``pair_0``, ``pair_1``, ...

    Args:
        scene: The scene.
        assets: Its assets by content hash.
    """
    objects = [(item.name, assets[item.asset_hash]) for item in scene.objects]
    spec = build_scene_spec(objects, visuals=True)
    spec.modelname = scene.scene_id
    add_lights(spec)
    add_ghost(spec, objects[0][1])
    for number, pair in enumerate(scene.goal_pairs):
        spec.add_key(
            name=f"pair_{number}",
            qpos=joint_state(pair.object_poses),
            ctrl=HOME_QPOS,
            mpos=np.array(pair.goal.position),
            mquat=np.array(pair.goal.quat_wxyz),
        )
    return spec


def add_ghost(spec: mujoco.MjSpec, asset: Asset) -> None:
    """Add the target's shape, translucent and without contact, as a mocap body named ``goal``."""
    ghost = spec.worldbody.add_body(name=GHOST, mocap=True)
    add_ghost_geoms(ghost, asset, name="target", rgba=(*GHOST_RGB, GHOST_OPACITY), group=VISUAL_GROUP)


def add_lights(spec: mujoco.MjSpec) -> None:
    """Add one key light with shadows and a fill light."""
    directional = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    spec.worldbody.add_light(pos=(-0.5, -1.0, 2.0), dir=(0.3, 0.5, -1.0), type=directional, castshadow=True)
    spec.worldbody.add_light(
        pos=(0.5, 1.0, 2.0), dir=(-0.2, -0.6, -1.0), type=directional, castshadow=False, diffuse=(0.3, 0.3, 0.3)
    )


def export_mjcf(scene: Scene, assets: Mapping[str, Asset], folder: Path) -> Path:
    """Write ``scene.xml`` and ``LICENCES.csv``.

    Args:
        scene: The scene.
        assets: Its assets by content hash.
        folder: Where to; made if missing.

    Returns:
        Path of ``scene.xml``.

    Raises:
        StorageError: The folder cannot be written.
    """
    spec = scene_spec(scene, assets)
    content = exact_xml(spec, spec.compile())
    write_bytes(folder / "LICENCES.csv", licence_table(scene, assets))
    write_bytes(folder / "scene.xml", content)
    return folder / "scene.xml"
