"""MuJoCo Menagerie's Franka Research 3 as the robot's look, if its files are already on this machine.

The package ``mujoco-menagerie`` downloads a model when it is first asked for; that is never done here. It is asked
only whether the model is in its cache (or below ``MENAGERIE_ROOT``) and where.
"""

import importlib
import logging
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from clutter6d.geometry import rotate
from clutter6d.physics import VISUAL_GROUP

MODEL_NAME = "franka_fr3"
_LOG = logging.getLogger(__name__)


def add_menagerie_visuals(spec: mujoco.MjSpec, bodies: Mapping[str, mujoco.MjsBody]) -> frozenset[str]:
    """Add Menagerie's visual meshes to the bodies of the same name.

    Args:
        spec: Specification that the bodies belong to.
        bodies: The robot's bodies by name.

    Returns:
        Names of the bodies that were given visuals; empty if the model is not on this machine.
    """
    path = cached_model_path()
    if path is None:
        return frozenset()
    try:
        return _copy_visuals(mujoco.MjModel.from_xml_path(str(path)), spec, bodies)
    except ValueError as error:
        _LOG.warning("Menagerie's model at %s cannot be read (%s); using the built-in look", path, error)
        return frozenset()


def cached_model_path() -> Path | None:
    """The model's file if the package is installed and the model is on this machine; never downloads."""
    try:
        menagerie = importlib.import_module("mujoco_menagerie")
        cache, robot = menagerie.Cache(), menagerie.get(MODEL_NAME)
        folder = cache.root / robot.name if cache.root else cache.model_path(robot)
        path = Path(folder) / robot.entry(robot.default_model).file
        is_present = path.is_file() and (cache.root or cache.is_cached(robot))
    except ImportError:
        return None
    except (AttributeError, LookupError, RuntimeError, TypeError) as error:
        _LOG.warning("the installed mujoco-menagerie is not understood (%s); using the built-in look", error)
        return None
    return path if is_present else None


def _copy_visuals(source: mujoco.MjModel, spec: mujoco.MjSpec, bodies: Mapping[str, mujoco.MjsBody]) -> frozenset[str]:
    """Copy compiled visual meshes: vertices relative to the body, and the material's colour."""
    dressed: set[str] = set()
    for geom in range(source.ngeom):
        body = source.body(source.geom_bodyid[geom]).name
        collides = source.geom_contype[geom] or source.geom_conaffinity[geom]
        if body not in bodies or source.geom_dataid[geom] < 0 or collides:
            continue
        name = f"{body}_menagerie{geom}"
        _add_mesh(source, geom, spec, name)
        material = source.geom_matid[geom]
        bodies[body].add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            rgba=source.mat_rgba[material] if material >= 0 else source.geom_rgba[geom],
            group=VISUAL_GROUP,
            contype=0,
            conaffinity=0,
            mass=0,
        )
        dressed.add(body)
    return frozenset(dressed)


def _add_mesh(source: mujoco.MjModel, geom: int, spec: mujoco.MjSpec, name: str) -> None:
    """Add a geom's mesh with its vertices in the frame of the geom's body."""
    mesh = source.geom_dataid[geom]
    vertices = slice(source.mesh_vertadr[mesh], source.mesh_vertadr[mesh] + source.mesh_vertnum[mesh])
    faces = slice(source.mesh_faceadr[mesh], source.mesh_faceadr[mesh] + source.mesh_facenum[mesh])
    in_body = rotate(source.geom_quat[geom], source.mesh_vert[vertices].astype(np.float64)) + source.geom_pos[geom]
    added = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    added.uservert = in_body.astype(np.float32).ravel()
    added.userface = source.mesh_face[faces].ravel()
