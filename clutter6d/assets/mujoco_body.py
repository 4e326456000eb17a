"""An asset as a free body of a MuJoCo model: explicit inertia, one mesh geom for each convex part."""

import mujoco
import numpy as np

from clutter6d.assets.asset import Asset, Mesh
from clutter6d.physics import COLLISION_GROUP, OBJECT_CONTACT, VISUAL_GROUP

TORSIONAL_FRICTION = 0.005
ROLLING_FRICTION = 0.0001
MIN_VERTICES = 4


def add_asset_body(spec: mujoco.MjSpec, asset: Asset, *, name: str, visuals: bool = False) -> mujoco.MjsBody:
    """Add one asset as a free body; the body frame is the object frame.

    Mass and inertia are the asset's own, never derived from the overlapping parts. The compiler moves the frame of
    each mesh to its centre and compensates in the geom, so the geometry stays where the asset has it.

    Args:
        spec: The model to add to.
        asset: The object.
        name: Name of the body; its joint is ``{name}_joint``, its geoms ``{name}_part{k}`` and ``{name}_visual{k}``.
        visuals: Whether to add the visual meshes too, massless and without contact.

    Returns:
        The new body, at the world's origin.
    """
    body = spec.worldbody.add_body(name=name)
    body.add_freejoint(name=f"{name}_joint")
    _set_inertia(body, asset)
    contype, conaffinity = OBJECT_CONTACT
    for index, part in enumerate(asset.parts):
        geom_name = f"{name}_part{index}"
        add_mesh(spec, geom_name, part)
        body.add_geom(
            name=geom_name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=geom_name,
            mass=0,
            friction=(asset.attributes.friction, TORSIONAL_FRICTION, ROLLING_FRICTION),
            contype=contype,
            conaffinity=conaffinity,
            group=COLLISION_GROUP,
            rgba=asset.visual[0].rgba,
        )
    if visuals:
        _add_visuals(spec, body, asset, name)
    return body


def _set_inertia(body: mujoco.MjsBody, asset: Asset) -> None:
    inertia = asset.mass_properties.inertia
    body.explicitinertial = True
    body.simple = False  # whether inertia is diagonal in the body frame must not change the layout of a batch
    body.mass = asset.mass_properties.mass_kg
    body.ipos = (0, 0, 0)
    upper = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
    body.fullinertia = [float(inertia[row, column]) for row, column in upper]


def _add_visuals(spec: mujoco.MjSpec, body: mujoco.MjsBody, asset: Asset, name: str) -> None:
    for index, visual in enumerate(asset.visual):
        mesh_name = f"{name}_visual{index}"
        add_mesh(spec, mesh_name, visual.mesh)
        _add_visual_geom(body, mesh_name, visual.rgba, VISUAL_GROUP, name=mesh_name)


def add_ghost_geoms(
    body: mujoco.MjsBody, asset: Asset, *, name: str, rgba: tuple[float, float, float, float], group: int
) -> None:
    """Show the visual meshes of an asset once more, on another body, in one colour and without contact.

    Args:
        body: Where to.
        asset: The object.
        name: Name under which ``add_asset_body`` has added the asset, with its visuals.
        rgba: Colour and opacity.
        group: Group of the geoms.
    """
    for index in range(len(asset.visual)):
        _add_visual_geom(body, f"{name}_visual{index}", rgba, group)


def _add_visual_geom(
    body: mujoco.MjsBody, mesh_name: str, rgba: tuple[float, float, float, float], group: int, *, name: str = ""
) -> None:
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=mesh_name,
        mass=0,
        contype=0,
        conaffinity=0,
        group=group,
        rgba=rgba,
    )


def add_mesh(spec: mujoco.MjSpec, name: str, mesh: Mesh) -> None:
    """Add a mesh; its unused inertia is a shell's, which needs no closed surface.

    MuJoCo wants four vertices at least, and a colour of a visual mesh may have fewer: the first is then repeated.
    """
    missing = max(0, MIN_VERTICES - len(mesh.vertices))
    vertices = np.concatenate([mesh.vertices, np.repeat(mesh.vertices[:1], missing, axis=0)])
    added = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    added.uservert = vertices.astype(np.float32).ravel()
    added.userface = np.asarray(mesh.faces, dtype=np.int32).ravel()
