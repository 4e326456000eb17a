"""The few kinds of prim that an exported scene is made of: frames, meshes, colours, physics materials, masses."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdPhysics, UsdShade

from clutter6d.export.colour import srgb_to_linear
from clutter6d.geometry import quat_from_matrix

PHYSICS_PURPOSE = "physics"


def unique_identifiers(names: Iterable[str]) -> dict[str, str]:
    """A valid prim name for each name, all different and as close to the name as USD allows."""
    found: dict[str, str] = {}
    for name in names:
        stem = candidate = Tf.MakeValidIdentifier(f"_{name}" if name[:1].isdigit() else name)
        number = 1
        while candidate in found.values():
            candidate, number = f"{stem}_{number}", number + 1
        found[name] = candidate
    return found


def add_frame(prim: UsdGeom.Xformable) -> tuple[UsdGeom.XformOp, UsdGeom.XformOp]:
    """Give a prim a position and an orientation, in double precision; returns both operations, without values."""
    translate = prim.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble)
    orient = prim.AddOrientOp(UsdGeom.XformOp.PrecisionDouble)
    return translate, orient


def place(
    prim: UsdGeom.Xformable, position: Float[np.ndarray, "3"], quat_wxyz: Float[np.ndarray, "4"]
) -> UsdGeom.Xformable:
    """Place a prim in its parent's frame [m]."""
    translate, orient = add_frame(prim)
    translate.Set(Gf.Vec3d(*map(float, position)))
    orient.Set(quatd(quat_wxyz))
    return prim


def quatd(quat_wxyz: Float[np.ndarray, "4"]) -> Gf.Quatd:
    """A quaternion as USD has it."""
    w, x, y, z = (float(value) for value in quat_wxyz)
    return Gf.Quatd(w, x, y, z)


def define_mesh(
    stage: Usd.Stage, path: Sdf.Path, vertices: Float[np.ndarray, "vertex 3"], faces: Int[np.ndarray, "face 3"]
) -> UsdGeom.Mesh:
    """Define a triangle mesh as it is: no subdivision, both sides visible."""
    points = np.ascontiguousarray(vertices, dtype=np.float32)
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr(np.full(len(faces), 3, dtype=np.int32))
    mesh.CreateFaceVertexIndicesAttr(np.ascontiguousarray(faces, dtype=np.int32).ravel())
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr(True)
    mesh.CreateExtentAttr(np.stack([points.min(axis=0), points.max(axis=0)]))
    return mesh


def define_colour(stage: Usd.Stage, path: Sdf.Path, rgba: tuple[float, float, float, float]) -> UsdShade.Material:
    """Define a matt material of one colour; RGBA as shown on a screen (sRGB)."""
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, path.AppendChild("surface"))
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*srgb_to_linear(rgba[:3])))
    shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(float(rgba[3]))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.6)
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(0.0)
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    return material


def define_friction(stage: Usd.Stage, path: Sdf.Path, friction: float) -> UsdShade.Material:
    """Define a physics material; of two touching materials the larger friction counts, as in MuJoCo."""
    material = UsdShade.Material.Define(stage, path)
    physics = UsdPhysics.MaterialAPI.Apply(material.GetPrim())
    physics.CreateStaticFrictionAttr(friction)
    physics.CreateDynamicFrictionAttr(friction)
    physics.CreateRestitutionAttr(0.0)
    token = Sdf.ValueTypeNames.Token
    add_vendor_schema(material.GetPrim(), "PhysxMaterialAPI", {"physxMaterial:frictionCombineMode": (token, "max")})
    return material


def bind_look(prim: Usd.Prim, material: UsdShade.Material, *, is_overriding: bool = False) -> None:
    """Bind a colour to a prim and all below it; overriding those bound below, if wanted."""
    strength = UsdShade.Tokens.strongerThanDescendants if is_overriding else UsdShade.Tokens.fallbackStrength
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(material, bindingStrength=strength)


def make_collider(prim: Usd.Prim, friction: UsdShade.Material, *, is_hull: bool = False) -> None:
    """Make a shape collide: as it is, or (a mesh) as its convex hull; renderers leave it out."""
    UsdPhysics.CollisionAPI.Apply(prim)
    if is_hull:
        UsdPhysics.MeshCollisionAPI.Apply(prim).CreateApproximationAttr(UsdPhysics.Tokens.convexHull)
    binding = UsdShade.MaterialBindingAPI.Apply(prim)
    binding.Bind(friction, materialPurpose=PHYSICS_PURPOSE)


def hide_from_renderers(prim: Usd.Prim) -> None:
    """Mark a prim as a guide: viewers show it on demand."""
    UsdGeom.Imageable(prim).CreatePurposeAttr(UsdGeom.Tokens.guide)


def make_rigid_body(
    prim: Usd.Prim, mass_kg: float, centre_m: Float[np.ndarray, "3"], inertia: Float[np.ndarray, "3 3"]
) -> None:
    """Make a prim a rigid body with explicit mass, and inertia about its centre of mass [kg m^2]."""
    UsdPhysics.RigidBodyAPI.Apply(prim)
    moments, axes = np.linalg.eigh(inertia)
    if np.linalg.det(axes) < 0:
        axes = axes * np.array([1.0, 1.0, -1.0])
    w, x, y, z = (float(value) for value in quat_from_matrix(axes))
    mass = UsdPhysics.MassAPI.Apply(prim)
    mass.CreateMassAttr(float(mass_kg))
    mass.CreateCenterOfMassAttr(Gf.Vec3f(*map(float, centre_m)))
    mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*map(float, moments)))
    mass.CreatePrincipalAxesAttr(Gf.Quatf(w, x, y, z))


def add_vendor_schema(prim: Usd.Prim, schema: str, values: Mapping[str, tuple[Sdf.ValueTypeName, Any]]) -> None:
    """Apply a schema that USD itself does not know, with its values; who does not know it, ignores it."""
    prim.AddAppliedSchema(schema)
    for name, (kind, value) in values.items():
        prim.CreateAttribute(name, kind, custom=False).Set(value)
