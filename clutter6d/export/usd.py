"""A scene as OpenUSD: metres, kilograms, z up, physics by USD's own schemas.

/World                   the scene; its variant set ``goal_pair`` chooses the task: poses of all objects and the goal
/World/table             static
/World/robot             articulation, fixed to its frame, at home (:mod:`clutter6d.export.usd_robot`)
/World/objects/NAME      one rigid body an object (:mod:`clutter6d.export.usd_object`)
/World/goal              the target's shape at the goal, translucent, purpose guide, touches nothing
/PhysicsScene            gravity; beside the scene, so that a stage that refers to the scene keeps its own

Scene graph, goal pairs, certificate and licences are custom data of the prims (:mod:`clutter6d.export.usd_metadata`).
Equal scenes give equal bytes.
"""

import os
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdPhysics, UsdUtils

from clutter6d.assets.asset import Asset
from clutter6d.errors import StorageError
from clutter6d.export.fixtures import fixtures, geom_colour
from clutter6d.export.licences import licence_table
from clutter6d.export.mjcf import GHOST_OPACITY, GHOST_RGB
from clutter6d.export.usd_metadata import KEY, object_data, scene_data
from clutter6d.export.usd_object import VISUAL, define_object
from clutter6d.export.usd_prims import (
    add_frame,
    bind_look,
    define_colour,
    define_friction,
    hide_from_renderers,
    make_collider,
    place,
    quatd,
    unique_identifiers,
)
from clutter6d.export.usd_robot import define_box, define_robot
from clutter6d.scene import TABLE, Scene
from clutter6d.schema import write_bytes

WORLD = Sdf.Path("/World")
GOAL = WORLD.AppendChild("goal")
OBJECTS = WORLD.AppendChild("objects")
GOAL_PAIR = "goal_pair"
PACKAGE_TIME = time.mktime((1980, 1, 1, 0, 0, 0, 0, 0, -1))
"""A package keeps its file's local time; a fixed one makes equal scenes equal packages, everywhere."""


def scene_stage(scene: Scene, assets: Mapping[str, Asset]) -> Usd.Stage:
    """A scene as a stage in memory, showing goal pair 0.

    Args:
        scene: The scene.
        assets: Its assets by content hash.
    """
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    world = UsdGeom.Xform.Define(stage, WORLD).GetPrim()
    Usd.ModelAPI(world).SetKind("assembly")
    world.SetCustomDataByKey(KEY, scene_data(scene))
    stage.SetDefaultPrim(world)
    _define_physics_scene(stage)
    _define_table(stage)
    define_robot(stage, WORLD.AppendChild("robot"))
    paths = _define_objects(stage, scene, assets)
    _define_goal(stage, paths[0])
    _define_goal_pairs(stage, scene, paths)
    return stage


def _define_physics_scene(stage: Usd.Stage) -> None:
    gravity = np.asarray(fixtures()[0].opt.gravity)
    strength = float(np.linalg.norm(gravity))
    physics = UsdPhysics.Scene.Define(stage, "/PhysicsScene")
    physics.CreateGravityDirectionAttr(Gf.Vec3f(*(gravity / strength).tolist()))
    physics.CreateGravityMagnitudeAttr(strength)


def _define_table(stage: Usd.Stage) -> None:
    table = UsdGeom.Xform.Define(stage, WORLD.AppendChild(TABLE))
    Usd.ModelAPI(table.GetPrim()).SetKind("component")
    model = fixtures()[0]
    geom = model.geom(TABLE)
    top = define_box(stage, table.GetPath().AppendChild("top"))
    place(top, geom.pos, geom.quat).AddScaleOp().Set(Gf.Vec3f(*(2 * geom.size).tolist()))
    bind_look(top.GetPrim(), define_colour(stage, table.GetPath().AppendChild("look"), geom_colour(model, geom.id)))
    make_collider(top.GetPrim(), define_friction(stage, table.GetPath().AppendChild("friction"), geom.friction[0]))


def _define_objects(stage: Usd.Stage, scene: Scene, assets: Mapping[str, Asset]) -> tuple[Sdf.Path, ...]:
    """Define every object, not yet placed; returns their paths in the scene's order."""
    UsdGeom.Xform.Define(stage, OBJECTS)
    Usd.ModelAPI(stage.GetPrimAtPath(OBJECTS)).SetKind("group")
    names = unique_identifiers(item.name for item in scene.objects)
    paths = tuple(OBJECTS.AppendChild(names[item.name]) for item in scene.objects)
    for path, item in zip(paths, scene.objects, strict=True):
        asset = assets[item.asset_hash]
        body = define_object(stage, path, asset)
        body.GetPrim().SetCustomDataByKey(KEY, object_data(item, asset))
        add_frame(body)
    return paths


def _define_goal(stage: Usd.Stage, target: Sdf.Path) -> None:
    """The target's visual once more, in one translucent colour."""
    goal = UsdGeom.Xform.Define(stage, GOAL)
    add_frame(goal)
    hide_from_renderers(goal.GetPrim())
    shape = UsdGeom.Xform.Define(stage, GOAL.AppendChild(VISUAL))
    shape.GetPrim().GetReferences().AddInternalReference(target.AppendChild(VISUAL))
    colour = define_colour(stage, GOAL.AppendChild("look"), (*GHOST_RGB, GHOST_OPACITY))
    bind_look(shape.GetPrim(), colour, is_overriding=True)


def _define_goal_pairs(stage: Usd.Stage, scene: Scene, paths: tuple[Sdf.Path, ...]) -> None:
    """One variant for each goal pair: where every object starts, and where the goal is."""
    world = stage.GetPrimAtPath(WORLD)
    variants = world.GetVariantSets().AddVariantSet(GOAL_PAIR)
    for number, pair in enumerate(scene.goal_pairs):
        variants.AddVariant(f"pair_{number}")
        variants.SetVariantSelection(f"pair_{number}")
        with variants.GetVariantEditContext():
            for path, row in zip((*paths, GOAL), (*pair.object_poses, pair.goal.as_row()), strict=True):
                translate, orient = UsdGeom.Xformable(stage.GetPrimAtPath(path)).GetOrderedXformOps()
                translate.Set(Gf.Vec3d(*row[:3].tolist()))
                orient.Set(quatd(row[3:]))
    variants.SetVariantSelection("pair_0")


def export_usd(scene: Scene, assets: Mapping[str, Asset], folder: Path) -> Path:
    """Write ``scene.usd`` (binary) and ``LICENCES.csv``.

    Args:
        scene: The scene.
        assets: Its assets by content hash.
        folder: Where to; made if missing.

    Returns:
        Path of ``scene.usd``.

    Raises:
        StorageError: The folder cannot be written.
    """
    with tempfile.TemporaryDirectory() as scratch:
        content = _export_crate(scene, assets, Path(scratch) / "scene.usd").read_bytes()
    write_bytes(folder / "LICENCES.csv", licence_table(scene, assets))
    write_bytes(folder / "scene.usd", content)
    return folder / "scene.usd"


def export_usdz(scene: Scene, assets: Mapping[str, Asset], folder: Path) -> Path:
    """Write ``scene.usdz``, the same stage in one package, and ``LICENCES.csv``; as :func:`export_usd`."""
    with tempfile.TemporaryDirectory() as scratch:
        crate = _export_crate(scene, assets, Path(scratch) / "scene.usdc")
        package = Path(scratch) / "scene.usdz"
        os.utime(crate, (PACKAGE_TIME, PACKAGE_TIME))
        _written(package, lambda: UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(crate)), str(package)))
        content = package.read_bytes()
    write_bytes(folder / "LICENCES.csv", licence_table(scene, assets))
    write_bytes(folder / "scene.usdz", content)
    return folder / "scene.usdz"


def _export_crate(scene: Scene, assets: Mapping[str, Asset], path: Path) -> Path:
    stage = scene_stage(scene, assets)  # a layer lives no longer than its stage
    return _written(path, lambda: stage.GetRootLayer().Export(str(path)))


def _written(path: Path, write: Callable[[], bool]) -> Path:
    """The path, once OpenUSD has written it."""
    try:
        is_written = write()
    except Tf.ErrorException:
        is_written = False
    if not is_written:
        raise StorageError(f"cannot write {path}: OpenUSD could not; is the disk full? nothing earlier was changed")
    return path
