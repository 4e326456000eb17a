"""What surrounds a scene in a picture: sky, floor, light, table legs, the robot's pedestal.

None of it collides; it is added to specifications that are made for pictures only.
"""

import mujoco

from clutter6d.physics import VISUAL_GROUP
from clutter6d.scene import TABLE_SIZE_M
from clutter6d.sim.robot_facts import BASE_POSITION_M

FLOOR_Z_M = -0.62
_TABLE_THICKNESS_M, _LEG_M = 0.05, 0.03
_SKY_TOP, _SKY_HORIZON = (0.56, 0.66, 0.76), (0.93, 0.95, 0.97)
_METAL, _FLOOR = (0.36, 0.38, 0.41, 1.0), (0.83, 0.84, 0.85, 1.0)


def add_studio(spec: mujoco.MjSpec) -> None:
    """Add sky, floor, light and furniture to a specification."""
    _add_sky_and_light(spec)
    _add_floor(spec)
    half_x, half_y = TABLE_SIZE_M[0] / 2 - 0.06, TABLE_SIZE_M[1] / 2 - 0.06
    half_height = -(FLOOR_Z_M + _TABLE_THICKNESS_M) / 2
    for x in (-half_x, half_x):
        for y in (-half_y, half_y):
            _box(spec, (x, y, FLOOR_Z_M + half_height), (_LEG_M, _LEG_M, half_height))
    _box(spec, (BASE_POSITION_M[0] - 0.03, 0.0, FLOOR_Z_M / 2), (0.068, 0.09, -FLOOR_Z_M / 2 - 0.001))


def _add_sky_and_light(spec: mujoco.MjSpec) -> None:
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=_SKY_TOP,
        rgb2=_SKY_HORIZON,
        width=256,
        height=1536,
    )
    spec.worldbody.add_light(
        name="key",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=(0.6, -1.0, 2.4),
        dir=(-0.35, 0.45, -1.0),
        diffuse=(0.50, 0.49, 0.47),
        specular=(0.15, 0.15, 0.15),
        castshadow=True,
    )
    spec.worldbody.add_light(
        name="fill",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=(-0.6, 1.5, 1.8),
        dir=(0.45, -0.7, -0.55),
        diffuse=(0.14, 0.15, 0.17),
        specular=(0, 0, 0),
        castshadow=False,
    )
    spec.visual.headlight.ambient = (0.36, 0.37, 0.39)
    spec.visual.headlight.diffuse = (0.16, 0.16, 0.16)
    spec.visual.headlight.specular = (0, 0, 0)
    spec.visual.quality.shadowsize = 4096
    spec.visual.quality.offsamples = 8
    spec.visual.map.znear = 0.02


def _add_floor(spec: mujoco.MjSpec) -> None:
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=(0, 0, FLOOR_Z_M),
        size=(6, 6, 0.1),
        rgba=_FLOOR,
        group=VISUAL_GROUP,
        contype=0,
        conaffinity=0,
    )


def _box(spec: mujoco.MjSpec, centre: tuple[float, float, float], half: tuple[float, float, float]) -> None:
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=centre,
        size=half,
        rgba=_METAL,
        group=VISUAL_GROUP,
        contype=0,
        conaffinity=0,
    )
