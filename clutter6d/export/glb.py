"""A scene as one binary glTF file, to look at: table, robot, objects in their colours, the goal as a ghost.

As glTF has it: metres, y up, the table seen from its front. Nodes are named as in the other formats; every object's
node carries its asset, category and licence, and the file's copyright names all authors.
"""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from clutter6d import __version__
from clutter6d.assets.asset import Asset, Licence
from clutter6d.export.fixtures import fixtures, geom_colour, geom_mesh, geoms_of, robot_bodies
from clutter6d.export.gltf_document import GltfDocument, Triangles
from clutter6d.export.licences import licence_table
from clutter6d.export.mjcf import GHOST, GHOST_OPACITY, GHOST_RGB
from clutter6d.scene import TABLE, PlacedObject, Scene
from clutter6d.schema import write_bytes

Z_UP_TO_Y_UP = np.array([np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0])
_BOX_VERTICES = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
_BOX_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    + [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)


def export_glb(scene: Scene, assets: Mapping[str, Asset], folder: Path) -> Path:
    """Write ``scene.glb``, goal pair 0, and ``LICENCES.csv``.

    Args:
        scene: The scene.
        assets: Its assets by content hash.
        folder: Where to; made if missing.

    Returns:
        Path of ``scene.glb``.

    Raises:
        StorageError: The folder cannot be written.
    """
    content = scene_glb(scene, assets)
    write_bytes(folder / "LICENCES.csv", licence_table(scene, assets))
    write_bytes(folder / "scene.glb", content)
    return folder / "scene.glb"


def scene_glb(scene: Scene, assets: Mapping[str, Asset], pair: int = 0) -> bytes:
    """A scene at the start of one goal pair; equal scenes give equal bytes.

    Args:
        scene: The scene.
        assets: Its assets by content hash.
        pair: Index of the goal pair.
    """
    licences = {assets[item.asset_hash].licence for item in scene.objects}
    document = GltfDocument({"generator": f"clutter6d {__version__}", "copyright": _copyright(licences)})
    shown = scene.goal_pairs[pair]
    shapes = [_add_shapes(document, assets[item.asset_hash]) for item in scene.objects]
    nodes = [_add_table(document), _add_robot(document)]
    for item, parts, row in zip(scene.objects, shapes, shown.object_poses, strict=True):
        asset = assets[item.asset_hash]
        coloured = [(part, visual.rgba) for part, visual in zip(parts, asset.visual, strict=True)]
        mesh = document.add_mesh(item.name, coloured)
        extras = _extras(item, asset)
        nodes.append(document.add_node(item.name, mesh=mesh, position=row[:3], quat_wxyz=row[3:], extras=extras))
    ghost = document.add_mesh(GHOST, [(part, (*GHOST_RGB, GHOST_OPACITY)) for part in shapes[0]])
    goal = shown.goal.as_row()
    nodes.append(document.add_node(GHOST, mesh=ghost, position=goal[:3], quat_wxyz=goal[3:]))
    root = document.add_node(scene.scene_id, children=nodes, quat_wxyz=Z_UP_TO_Y_UP)
    return document.to_glb(root, extras={"sceneId": scene.scene_id, "track": scene.track, "goalPair": pair})


def _add_shapes(document: GltfDocument, asset: Asset) -> list[Triangles]:
    return [document.add_triangles(visual.mesh.vertices, visual.mesh.faces) for visual in asset.visual]


def _add_table(document: GltfDocument) -> int:
    model = fixtures()[0]
    geom = model.geom(TABLE)
    top = document.add_triangles(_BOX_VERTICES * geom.size, _BOX_FACES)
    mesh = document.add_mesh(TABLE, [(top, geom_colour(model, geom.id))])
    return document.add_node(TABLE, mesh=mesh, position=geom.pos)


def _add_robot(document: GltfDocument) -> int:
    """The robot at home: a node for each link that shows, side by side, and one for each of its shells."""
    model, data = fixtures()
    links: list[int] = []
    for body in robot_bodies(model):
        shells: list[int] = []
        for geom in geoms_of(model, body, colliding=False):
            name = model.geom(geom).name
            mesh = document.add_mesh(
                name, [(document.add_triangles(*geom_mesh(model, geom)), geom_colour(model, geom))]
            )
            pose = {"position": model.geom_pos[geom], "quat_wxyz": model.geom_quat[geom]}
            shells.append(document.add_node(name, mesh=mesh, **pose))
        pose = {"position": data.xpos[body], "quat_wxyz": data.xquat[body]}
        if shells:
            links.append(document.add_node(model.body(body).name, children=shells, **pose))
    return document.add_node("robot", children=links)


def _extras(item: PlacedObject, asset: Asset) -> dict[str, Any]:
    return {
        "role": item.role,
        "asset": item.asset_name,
        "assetHash": item.asset_hash,
        "category": asset.attributes.category,
        "massKg": asset.mass_properties.mass_kg,
        "licence": asdict(asset.licence),
    }


def _copyright(licences: set[Licence]) -> str:
    """All authors with the terms of their objects."""
    return "; ".join(sorted({f"{licence.author} ({licence.name})" for licence in licences}))
