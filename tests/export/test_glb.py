"""GLB export: opens elsewhere, stands upright, says what it is made of."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from clutter6d.export.glb import export_glb, scene_glb
from clutter6d.geometry import transform_points
from tests.export.export_fixtures import LICENCE_NAME, crooked_scene


@pytest.fixture(scope="module")
def glb(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_glb(*crooked_scene(), tmp_path_factory.mktemp("glb"))


def document(content: bytes) -> dict:
    """The JSON of a binary glTF file."""
    magic, version, length, chunk, kind = struct.unpack("<4sIII4s", content[:20])
    assert (magic, version, length, kind) == (b"glTF", 2, len(content), b"JSON")
    return json.loads(content[20 : 20 + chunk])


def test_others_read_every_object_in_its_place_with_y_up(glb: Path) -> None:
    scene, assets = crooked_scene()
    loaded = trimesh.load_scene(glb, process=False)
    for item, row in zip(scene.objects, scene.goal_pairs[0].object_poses, strict=True):
        expected = np.concatenate(
            [transform_points(row, visual.mesh.vertices.astype(float)) for visual in assets[item.asset_hash].visual]
        )
        nodes = [node for node in loaded.graph.nodes_geometry if is_below(loaded, node, item.name)]
        found = np.concatenate([vertices_of(loaded, node) for node in nodes])
        upright = np.stack([expected[:, 0], expected[:, 2], -expected[:, 1]], axis=1)
        np.testing.assert_allclose(bounds(found), bounds(upright), atol=1e-6)


def is_below(scene: trimesh.Scene, node: str, name: str) -> bool:
    return node == name or scene.graph.transforms.parents.get(node) == name


def vertices_of(scene: trimesh.Scene, node: str) -> np.ndarray:
    transform, geometry = scene.graph.get(node)
    return trimesh.transform_points(scene.geometry[geometry].vertices, transform)


def bounds(points: np.ndarray) -> np.ndarray:
    return np.stack([points.min(axis=0), points.max(axis=0)])


def test_table_robot_objects_and_ghost_are_there_by_name(glb: Path) -> None:
    names = [node["name"] for node in document(glb.read_bytes())["nodes"]]
    assert {"table", "robot", "fr3_link7", "hand", "target", "large_0", "goal", "boxes-0"} <= set(names)


def test_the_ghost_shares_the_targets_shape_and_is_translucent(glb: Path) -> None:
    told = document(glb.read_bytes())
    shown = {mesh["name"]: mesh["primitives"] for mesh in told["meshes"]}
    shapes = [[part["attributes"] for part in shown[name]] for name in ("target", "goal")]
    assert shapes[0] == shapes[1]
    looks = [told["materials"][part["material"]] for part in shown["goal"]]
    assert {look["alphaMode"] for look in looks} == {"BLEND"}


def test_terms_and_authors_are_in_the_file(glb: Path) -> None:
    told = document(glb.read_bytes())
    assert told["asset"]["copyright"] == f"A. Potter ({LICENCE_NAME}); Clutter6D (Apache-2.0)"
    target = next(node for node in told["nodes"] if node["name"] == "target")
    assert (target["extras"]["licence"]["name"], target["extras"]["category"]) == (LICENCE_NAME, "mug")
    assert LICENCE_NAME in (glb.parent / "LICENCES.csv").read_text()


def test_another_pair_shows_another_goal() -> None:
    scene, assets = crooked_scene()
    told = document(scene_glb(scene, assets, pair=1))
    goal = next(node for node in told["nodes"] if node["name"] == "goal")
    np.testing.assert_allclose(goal["translation"], scene.goal_pairs[1].goal.position)


def test_data_is_aligned_and_counted(glb: Path) -> None:
    told = document(glb.read_bytes())
    assert all(view["byteOffset"] % 4 == 0 for view in told["bufferViews"])
    assert told["buffers"][0]["byteLength"] == sum(view["byteLength"] for view in told["bufferViews"])
    assert len(glb.read_bytes()) % 4 == 0


def test_equal_scenes_give_equal_bytes(glb: Path, tmp_path: Path) -> None:
    assert export_glb(*crooked_scene(), tmp_path).read_bytes() == glb.read_bytes()
