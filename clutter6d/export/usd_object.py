"""An asset as a rigid body of a USD stage.

{path}                   rigid body with explicit mass and inertia; its frame is the object frame
{path}/visual            what renderers show: one mesh and one material a colour; refers to nothing outside itself
{path}/collision/part_k  one collider for each convex part, purpose guide
{path}/friction          physics material
"""

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from clutter6d.assets.asset import Asset
from clutter6d.export.usd_prims import (
    bind_look,
    define_colour,
    define_friction,
    define_mesh,
    hide_from_renderers,
    make_collider,
    make_rigid_body,
)

VISUAL = "visual"
COLLISION = "collision"


def define_object(stage: Usd.Stage, path: Sdf.Path, asset: Asset) -> UsdGeom.Xform:
    """Define one asset as a rigid body.

    Args:
        stage: The stage to define it on.
        path: Of the body.
        asset: The object.

    Returns:
        The body, not yet placed.
    """
    body = UsdGeom.Xform.Define(stage, path)
    Usd.ModelAPI(body.GetPrim()).SetKind("component")
    make_rigid_body(
        body.GetPrim(), asset.mass_properties.mass_kg, np.zeros(3), np.asarray(asset.mass_properties.inertia)
    )
    _define_visual(stage, path.AppendChild(VISUAL), asset)
    _define_collision(stage, path, asset)
    return body


def _define_visual(stage: Usd.Stage, path: Sdf.Path, asset: Asset) -> None:
    UsdGeom.Xform.Define(stage, path)
    UsdGeom.Scope.Define(stage, path.AppendChild("looks"))
    for index, visual in enumerate(asset.visual):
        mesh = define_mesh(stage, path.AppendChild(f"mesh_{index}"), visual.mesh.vertices, visual.mesh.faces)
        colour = define_colour(stage, path.AppendPath(f"looks/colour_{index}"), visual.rgba)
        bind_look(mesh.GetPrim(), colour)


def _define_collision(stage: Usd.Stage, path: Sdf.Path, asset: Asset) -> None:
    friction = define_friction(stage, path.AppendChild("friction"), asset.attributes.friction)
    hide_from_renderers(UsdGeom.Xform.Define(stage, path.AppendChild(COLLISION)).GetPrim())
    for index, part in enumerate(asset.parts):
        mesh = define_mesh(stage, path.AppendPath(f"{COLLISION}/part_{index}"), part.vertices, part.faces)
        make_collider(mesh.GetPrim(), friction, is_hull=True)
