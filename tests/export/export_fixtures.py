"""A cheap scene that leaves nothing to chance: a crooked target of two parts and two colours, and three boxes."""

from dataclasses import replace
from functools import cache

import numpy as np

from clutter6d.assets.asset import Asset, Mesh, VisualMesh, hash_asset
from clutter6d.geometry import quat_normalize, quat_to_matrix
from clutter6d.scene import Scene
from tests.scene_fixtures import make_box_scene_set

TURN = quat_to_matrix(quat_normalize(np.array([0.7, -0.3, 0.5, 0.4])))
LICENCE_NAME = "CC-BY-3.0"


@cache
def crooked_scene(index: int = 0) -> tuple[Scene, dict[str, Asset]]:
    """A scene and its assets; the target's principal axes are turned, and its terms are not the others'."""
    made = make_box_scene_set(index + 1)
    scene, assets = made.scenes[index], dict(made.assets_of(made.scenes[index]))
    target = crooked_asset(assets.pop(scene.target.asset_hash))
    objects = (replace(scene.target, asset_hash=target.content_hash), *scene.objects[1:])
    return replace(scene, objects=objects), {target.content_hash: target, **assets}


def crooked_asset(box: Asset) -> Asset:
    """A box with another box on its side, its inertia turned, one of its colours translucent."""
    mesh = box.parts[0]
    lug = Mesh(vertices=(mesh.vertices * [0.3, 0.4, 0.2] + [0.031, 0.007, 0.013]).astype(np.float32), faces=mesh.faces)
    inertia = TURN @ box.mass_properties.inertia @ TURN.T
    changed = replace(
        box,
        visual=(box.visual[0], VisualMesh(mesh=lug, rgba=(0.1, 0.3, 0.8, 0.5))),
        parts=(mesh, lug),
        mass_properties=replace(box.mass_properties, mass_kg=0.1234567, inertia=(inertia + inertia.T) / 2),
        attributes=replace(box.attributes, friction=0.37, category="mug"),
        licence=replace(box.licence, name=LICENCE_NAME, author="A. Potter"),
    )
    return replace(changed, content_hash=hash_asset(changed))
