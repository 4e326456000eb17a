"""What surrounds a scene in a picture: sky, floor, light, table legs, the robot's pedestal.

None of it collides; it is added to specifications that are made for pictures only.
"""

import mujoco
import numpy as np
from jaxtyping import Float64

from clutter6d.physics import VISUAL_GROUP
from clutter6d.scene import TABLE_SIZE_M
from clutter6d.sim.robot_facts import BASE_POSITION_M

FLOOR_Z_M = -0.62
_TABLE_THICKNESS_M, _LEG_M = 0.05, 0.03
_METAL, _FLOOR = (0.36, 0.38, 0.41, 1.0), (0.80, 0.81, 0.82, 1.0)

TABLE_LEGS = tuple(f"table_leg{index}" for index in range(4))

GHOST_GROUP = 1
"""Group of geoms that only show where something shall be; drawn translucent."""

SHOWN_GROUPS = (0, GHOST_GROUP, VISUAL_GROUP)

SKY_TOP = np.array([0.78, 0.85, 0.91])
SKY_HORIZON = np.array([0.94, 0.955, 0.97])


def _unit(x: float, y: float, z: float) -> Float64[np.ndarray, "3"]:
    return np.array([x, y, z]) / np.sqrt(x * x + y * y + z * z)


KEY_DIRECTION = _unit(0.35, -0.45, 1.0)
FILL_DIRECTION = _unit(-0.45, 0.70, 0.55)
"""Directions towards the two lights."""


def add_studio(spec: mujoco.MjSpec) -> None:
    """Add sky, floor, light and furniture to a specification."""
    add_sky_and_light(spec)
    _add_floor(spec)
    half_x, half_y = TABLE_SIZE_M[0] / 2 - 0.06, TABLE_SIZE_M[1] / 2 - 0.06
    half_height = -(FLOOR_Z_M + _TABLE_THICKNESS_M) / 2
    corners = ((x, y) for x in (-half_x, half_x) for y in (-half_y, half_y))
    for name, (x, y) in zip(TABLE_LEGS, corners, strict=True):
        _box(spec, name, (x, y, FLOOR_Z_M + half_height), (_LEG_M, _LEG_M, half_height))
    _box(spec, "pedestal", (BASE_POSITION_M[0] - 0.03, 0.0, FLOOR_Z_M / 2), (0.068, 0.09, -FLOOR_Z_M / 2 - 0.001))


def add_sky_and_light(spec: mujoco.MjSpec) -> None:
    """Add the sky, a key light with shadows and a fill light to a specification."""
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=SKY_TOP,
        rgb2=SKY_HORIZON,
        width=256,
        height=1536,
    )
    spec.worldbody.add_light(
        name="key",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=(0.6, -1.0, 2.4),
        dir=-KEY_DIRECTION,
        diffuse=(0.50, 0.49, 0.48),
        specular=(0.15, 0.15, 0.15),
        castshadow=True,
    )
    spec.worldbody.add_light(
        name="fill",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=(-0.6, 1.5, 1.8),
        dir=-FILL_DIRECTION,
        diffuse=(0.14, 0.15, 0.17),
        specular=(0, 0, 0),
        castshadow=False,
    )
    spec.visual.headlight.ambient = (0.42, 0.42, 0.43)
    spec.visual.headlight.diffuse = (0.16, 0.16, 0.16)
    spec.visual.headlight.specular = (0, 0, 0)
    spec.visual.quality.shadowsize = 4096
    spec.visual.map.shadowclip = 2.0
    spec.visual.map.znear = 0.02
    spec.stat.extent, spec.stat.center = 1.0, (0.0, 0.0, 0.0)
    spec.visual.map.fogstart, spec.visual.map.fogend = 2.5, 8.0
    spec.visual.rgba.fog = (*SKY_HORIZON, 1.0)


def _add_floor(spec: mujoco.MjSpec) -> None:
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=(0, 0, FLOOR_Z_M),
        size=(0, 0, 0.1),
        rgba=_FLOOR,
        group=VISUAL_GROUP,
        contype=0,
        conaffinity=0,
    )


def _box(spec: mujoco.MjSpec, name: str, centre: tuple[float, float, float], half: tuple[float, float, float]) -> None:
    spec.worldbody.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=centre,
        size=half,
        rgba=_METAL,
        group=VISUAL_GROUP,
        contype=0,
        conaffinity=0,
    )
