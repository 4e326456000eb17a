"""What a scene is, told in the custom data of a USD stage: scene graph, goal pairs, certificate, licences."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from pxr import Vt

from clutter6d import __version__
from clutter6d.assets.asset import Asset
from clutter6d.scene import GoalPair, PlacedObject, Relation, Scene

KEY = "clutter6d"


def scene_data(scene: Scene) -> dict[str, Any]:
    """Custom data of the scene's root."""
    return {
        "schemaVersion": 1,
        "generator": f"clutter6d {__version__}",
        "sceneId": scene.scene_id,
        "track": scene.track,
        "seed": str(scene.seed),
        "index": scene.index,
        "target": scene.target.name,
        "objects": Vt.StringArray([item.name for item in scene.objects]),
        "sceneGraph": _graph_data(scene.graph.relations),
        "goalPairs": {f"pair_{number}": _pair_data(pair) for number, pair in enumerate(scene.goal_pairs)},
        "certificate": {
            _camel(field.name): getattr(scene.certificate, field.name) for field in fields(scene.certificate)
        },
    }


def object_data(item: PlacedObject, asset: Asset) -> dict[str, Any]:
    """Custom data of a placed object: which asset it is, its attributes, and its licence."""
    attributes, licence = asset.attributes, asset.licence
    return {
        "name": item.name,
        "role": item.role,
        "stableIndex": item.stable_index,
        "asset": item.asset_name,
        "assetHash": item.asset_hash,
        "category": attributes.category,
        "colour": attributes.colour,
        "material": attributes.material,
        "licence": {_camel(field.name): getattr(licence, field.name) for field in fields(licence)},
    }


def _graph_data(relations: tuple[Relation, ...]) -> Mapping[str, Any]:
    """The relations as four columns of equal length."""
    return {
        "kinds": Vt.StringArray([relation.kind for relation in relations]),
        "subjects": Vt.StringArray([relation.subject for relation in relations]),
        "references": Vt.StringArray([relation.reference for relation in relations]),
        "secondReferences": Vt.StringArray([relation.second_reference or "" for relation in relations]),
    }


def _pair_data(pair: GoalPair) -> Mapping[str, Any]:
    """One task; poses are ``x y z qw qx qy qz``."""
    return {
        "initial": Vt.DoubleArray(pair.initial.as_row().tolist()),
        "goal": Vt.DoubleArray(pair.goal.as_row().tolist()),
        "initialStableIndex": pair.initial_stable_index,
        "goalStableIndex": pair.goal_stable_index,
        "isPathBlocked": pair.is_path_blocked,
        "changesRestingFace": pair.changes_resting_face,
    }


def _camel(name: str) -> str:
    first, *rest = name.split("_")
    return first + "".join(word.title() for word in rest)
