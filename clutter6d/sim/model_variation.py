"""Compiled scenes with other masses, frictions or table heights, without compiling again.

A varied model has the layout of the one it was made from, so both run side by side in one batch. It is the model that
would be compiled of assets with these values; only the last bits of constants derived from them may differ.
"""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace

import mujoco
import numpy as np
from jaxtyping import Float, Float64

from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.sim.scene_model import SceneModel

SLEEP_TOLERANCE_M_S = 1e-3
"""Velocity below which an object may fall asleep; MuJoCo's own 0.1 mm/s is seldom reached by objects on a table."""
_AABB_CENTRE_Z = 2
"""A bounding box is its centre, then its half sizes."""


def vary_model(
    scene: SceneModel,
    *,
    mass_scale: Float[np.ndarray, "object"] | None = None,
    friction_scale: Float[np.ndarray, "object"] | None = None,
    table_height_m: float | None = None,
) -> SceneModel:
    """A copy of a compiled scene with scaled masses and frictions and with a raised table; 1 ms.

    What is not given stays as it is. Object poses are the caller's: raise them with :func:`raise_poses`. The robot's
    base stays where it is.

    Args:
        scene: The scene; it is not changed.
        mass_scale: Factor of each object's mass and inertia; its size and shape stay.
        friction_scale: Factor of each object's sliding, torsional and rolling friction. MuJoCo takes the larger value
            of the two geoms that meet, so a value below the table's 0.3 or the fingers' 1.0 does not show there.
        table_height_m: Where the top of the table shall be [m]; 0 in the benchmark.

    Raises:
        InvalidValueError: A scale is missing, not positive or not finite, or the height is not finite.
    """
    model = copy.copy(scene.model)
    bodies = scene.object_body_ids()
    if mass_scale is not None:
        factors = _checked("mass", mass_scale, scene)
        model.body_mass[bodies] *= factors
        model.body_inertia[bodies] *= factors[:, None]
    if friction_scale is not None:
        for body, factor in zip(bodies, _checked("friction", friction_scale, scene), strict=True):
            first = model.body_geomadr[body]
            model.geom_friction[first : first + model.body_geomnum[body]] *= factor
    if table_height_m is not None:
        set_table_height(model, table_height_m)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return replace(scene, model=model)


def let_sleep(scene: SceneModel) -> SceneModel:
    """A copy whose objects are not simulated while they are at rest and untouched; for training.

    Sparse scenes run two to three times as fast. What happens in them is no longer the benchmark's to the bit: an
    object that creeps by less than 1 mm/s stands still.
    """
    model = copy.copy(scene.model)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    model.opt.sleep_tolerance = SLEEP_TOLERANCE_M_S
    return replace(scene, model=model)


def set_table_height(model: mujoco.MjModel, height_m: float) -> None:
    """Move the table of a model of one's own so that its top is at a height [m].

    Raises:
        InvalidValueError: The height is not finite.
    """
    if not np.isfinite(height_m):
        raise InvalidValueError(f"table height {height_m} m is not a finite number")
    table = model.geom("table").id
    lift = height_m - table_height_m(model)
    model.geom_pos[table, 2] += lift
    bounds = slice(model.body_bvhadr[0], model.body_bvhadr[0] + model.body_bvhnum[0])
    of_table = model.bvh_nodeid[bounds] == table
    model.bvh_aabb[bounds][of_table, _AABB_CENTRE_Z] += lift


def table_height_m(model: mujoco.MjModel) -> float:
    """Height of the table's top [m]; 0 in the benchmark."""
    table = model.geom("table")
    return float(table.pos[2] + table.size[2])


def raise_poses(poses: Float64[np.ndarray, "*n 7"], height_m: Float[np.ndarray, "*#n"] | float) -> np.ndarray:
    """Poses moved up with the table [m]; rotations stay."""
    raised = poses.copy()
    raised[..., 2] += height_m
    return raised


def named_scales(names: Sequence[str], scales: Mapping[str, float]) -> Float64[np.ndarray, "object"]:
    """Factors of a scene's objects, 1 where nothing is said (paper, "More Analysis on Adaptive Behavior": 100 and 0.1).

    Args:
        names: Names of the scene's objects.
        scales: Factor by name, for instance ``{"large_0": 100.0, "small_1": 0.1}``.

    Raises:
        UnknownNameError: The scene has no object of that name.
    """
    unknown = [name for name in scales if name not in names]
    if unknown:
        raise UnknownNameError("object", unknown[0], names)
    return np.array([float(scales.get(name, 1.0)) for name in names])


def _checked(what: str, scale: Float[np.ndarray, "_"], scene: SceneModel) -> Float64[np.ndarray, "object"]:
    factors = np.asarray(scale, dtype=np.float64)
    if factors.shape != (scene.object_count,) or not (np.isfinite(factors) & (factors > 0)).all():
        raise InvalidValueError(
            f"{what} scale {factors.tolist()}: give one positive number for each of the {scene.object_count} objects"
        )
    return factors
