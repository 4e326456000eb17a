"""Physics settings beside the benchmark's own: each one change to the compiled models of the same scenes."""

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from frozen_tasks import Tasks

from clutter6d.assets.asset import Asset, Mesh
from clutter6d.assets.convex_part import reduce_hull
from clutter6d.assets.decomposition import MAX_PART_VERTICES
from clutter6d.assets.solid import manifold_arrays
from clutter6d.errors import InvalidValueError
from clutter6d.physics import PHYSICS_STEP_S
from clutter6d.sim.scene_model import build_scene_spec, compile_scene

Models = list[mujoco.MjModel]
_DISABLE, _ENABLE = mujoco.mjtDisableBit, mujoco.mjtEnableBit


@dataclass(frozen=True, kw_only=True, slots=True)
class Variant:
    """One physics setting.

    Attributes:
        name: What differs from the benchmark's setting.
        models: The models of tasks under this setting.
        is_persistent: Whether the batch keeps one ``MjData`` for each simulation.
        physics_step_s: Of the models.
        start_offset_m: By how much the target is moved at the start of a push.
    """

    name: str
    models: Callable[[Tasks], Models]
    is_persistent: bool = False
    physics_step_s: float = PHYSICS_STEP_S
    start_offset_m: float = 0.0


def as_they_are(tasks: Tasks) -> Models:
    """The benchmark's own models."""
    return [scene.model for scene in tasks.models]


def changed(change: Callable[[mujoco.MjModel], None]) -> Callable[[Tasks], Models]:
    """Copies of the models with a change."""

    def make(tasks: Tasks) -> Models:
        models = [copy.copy(scene.model) for scene in tasks.models]
        for model in models:
            change(model)
        return models

    return make


def option(name: str, **values: float) -> Variant:
    """Other engine options."""

    def change(model: mujoco.MjModel) -> None:
        for key, value in values.items():
            setattr(model.opt, key, value)

    return Variant(name=name, models=changed(change))


def without(name: str, flag: mujoco.mjtDisableBit, *further: mujoco.mjtDisableBit) -> Variant:
    """With features switched off."""

    def change(model: mujoco.MjModel) -> None:
        model.opt.disableflags |= sum(int(item) for item in (flag, *further))

    return Variant(name=name, models=changed(change))


def contact_dimension(dimension: int, meaning: str) -> Variant:
    """All contacts with another dimension."""

    def change(model: mujoco.MjModel) -> None:
        model.geom_condim[:] = dimension

    return Variant(name=f"contacts: condim {dimension} ({meaning})", models=changed(change))


def physics_step(milliseconds: float) -> Variant:
    """Another physics step; the control step stays 0.1 s."""

    def change(model: mujoco.MjModel) -> None:
        model.opt.timestep = milliseconds / 1000

    name = f"physics step: {milliseconds:g} ms"
    return Variant(name=name, models=changed(change), physics_step_s=milliseconds / 1000)


def asleep(tolerance: float) -> Variant:
    """Objects that are still fall asleep, and are not simulated until something touches them."""

    def change(model: mujoco.MjModel) -> None:
        model.opt.enableflags |= int(_ENABLE.mjENBL_SLEEP)
        model.opt.sleep_tolerance = tolerance

    return Variant(name=f"sleep: objects slower than {tolerance:g} m/s", models=changed(change), is_persistent=True)


def parts(most: int) -> Variant:
    """Objects with at most so many convex parts: the nearest ones are joined into their common hull."""

    def make(tasks: Tasks) -> Models:
        joined: dict[str, Asset] = {}
        for scene in tasks.models:
            joined |= {
                asset.content_hash: with_parts(asset, most)
                for asset in scene.assets
                if asset.content_hash not in joined
            }
        return [
            compile_scene([(n, joined[a.content_hash]) for n, a in zip(scene.names, scene.assets, strict=True)]).model
            for scene in tasks.models
        ]

    return Variant(name=f"parts: at most {most} an object", models=make)


def with_parts(asset: Asset, most: int) -> Asset:
    """The asset with its nearest parts joined until at most so many are left."""
    groups = [np.asarray(part.vertices, dtype=np.float64) for part in asset.parts]
    while len(groups) > most:
        centres = np.array([(points.min(axis=0) + points.max(axis=0)) / 2 for points in groups])
        distances = np.linalg.norm(centres[:, None] - centres[None], axis=-1) + np.diag(np.full(len(groups), np.inf))
        i, j = sorted(np.unravel_index(np.argmin(distances), distances.shape))
        groups[i] = np.concatenate([groups[i], groups.pop(j)])
    return asset if len(groups) == len(asset.parts) else replace(asset, parts=tuple(map(_hull, groups)))


def _hull(points: np.ndarray) -> Mesh:
    hull = reduce_hull(points, MAX_PART_VERTICES)
    if hull is None:
        raise InvalidValueError("the common hull of parts is flat")
    vertices, faces = manifold_arrays(hull)
    return Mesh(vertices=vertices.astype(np.float32), faces=faces.astype(np.int32))


def unpadded(tasks: Tasks) -> Models:
    """The models without what gives all scenes one layout."""
    return [build_scene_spec(list(zip(s.names, s.assets, strict=True))).compile() for s in tasks.models]


REFERENCE = Variant(name="the benchmark's setting", models=as_they_are)
YARDSTICKS = tuple(
    Variant(name=f"the same, target moved by {text} before", models=as_they_are, start_offset_m=offset_m)
    for text, offset_m in (("1 µm", 1e-6), ("0.1 mm", 1e-4))
)
"""How much a push forgives: settings of other physics are seen beside these."""

_ELLIPTIC = int(mujoco.mjtCone.mjCONE_ELLIPTIC)

VARIANTS = (
    *YARDSTICKS,
    Variant(name="memory: a persistent batch", models=as_they_are, is_persistent=True),
    *(parts(most) for most in (8, 4, 2, 1)),
    option("solver: CG", solver=int(mujoco.mjtSolver.mjSOL_CG)),
    option("solver: PGS", solver=int(mujoco.mjtSolver.mjSOL_PGS)),
    *(option(f"solver: {count} iterations", iterations=count) for count in (3, 5, 10, 100)),
    option("solver: 5 line-search iterations", ls_iterations=5),
    option("solver: 50 line-search iterations", ls_iterations=50),
    option("solver: tolerance 1e-6", tolerance=1e-6),
    option("solver: tolerance 1e-4", tolerance=1e-4),
    without("solver: no warm start", _DISABLE.mjDSBL_WARMSTART),
    without("solver: no islands", _DISABLE.mjDSBL_ISLAND),
    option("Jacobian: dense", jacobian=int(mujoco.mjtJacobian.mjJAC_DENSE)),
    option("Jacobian: sparse", jacobian=int(mujoco.mjtJacobian.mjJAC_SPARSE)),
    option("cone: elliptic", cone=_ELLIPTIC),
    option("cone: elliptic, impratio 10", cone=_ELLIPTIC, impratio=10),
    contact_dimension(1, "no friction"),
    contact_dimension(4, "torsional friction"),
    contact_dimension(6, "rolling friction"),
    without("collision: one contact a pair of parts", _DISABLE.mjDSBL_MULTICCD),
    without("collision: libccd, several contacts", _DISABLE.mjDSBL_NATIVECCD),
    without("collision: no mid-phase", _DISABLE.mjDSBL_MIDPHASE),
    option("collision: 12 iterations", ccd_iterations=12),
    option("collision: tolerance 1e-4 m", ccd_tolerance=1e-4),
    option("collision: tolerance 1e-8 m", ccd_tolerance=1e-8),
    asleep(1e-3),
    asleep(1e-2),
    option("integrator: Euler", integrator=int(mujoco.mjtIntegrator.mjINT_EULER)),
    option("integrator: implicit", integrator=int(mujoco.mjtIntegrator.mjINT_IMPLICIT)),
    *(physics_step(milliseconds) for milliseconds in (2.0, 2.5, 10.0)),
)
