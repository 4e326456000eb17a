"""What all scenes have in common: table and robot, read from the compiled MuJoCo model so that every format agrees."""

from collections.abc import Iterator
from functools import cache

import mujoco
import numpy as np
from jaxtyping import Float32, Int32

from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.scene_model import build_scene_spec

Colour = tuple[float, float, float, float]


@cache
def fixtures() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Table and robot with its visuals, at its home posture."""
    model = build_scene_spec((), visuals=True).compile()
    data = mujoco.MjData(model)
    data.qpos[:] = HOME_QPOS
    mujoco.mj_kinematics(model, data)
    return model, data


def geoms_of(model: mujoco.MjModel, body: int, *, colliding: bool) -> list[int]:
    """A body's geoms that collide, or those that do not."""
    start = model.body_geomadr[body]
    geoms = range(start, start + model.body_geomnum[body])
    return [geom for geom in geoms if bool(model.geom_contype[geom]) == colliding]


def robot_bodies(model: mujoco.MjModel) -> Iterator[int]:
    """The robot's bodies, base to fingers."""
    return iter(range(1, model.nbody))


def geom_mesh(model: mujoco.MjModel, geom: int) -> tuple[Float32[np.ndarray, "vertex 3"], Int32[np.ndarray, "face 3"]]:
    """Vertices and faces of a mesh geom, in the geom's frame."""
    mesh = model.mesh(model.geom_dataid[geom])
    vertices = model.mesh_vert[mesh.vertadr[0] : mesh.vertadr[0] + mesh.vertnum[0]]
    return vertices, model.mesh_face[mesh.faceadr[0] : mesh.faceadr[0] + mesh.facenum[0]]


def geom_colour(model: mujoco.MjModel, geom: int) -> Colour:
    """RGBA of a geom, as shown on a screen."""
    red, green, blue, alpha = (float(value) for value in model.geom_rgba[geom])
    return red, green, blue, alpha
