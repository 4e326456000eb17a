"""The shared vocabulary: what a scene file holds, what it refuses, and in which order objects are placed."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clutter6d.errors import InvalidFileError, InvalidValueError, MissingFileError
from clutter6d.geometry import Pose, quat_normalize
from clutter6d.scene import (
    TABLE,
    Certificate,
    GoalPair,
    PlacedObject,
    Relation,
    RelationKind,
    Scene,
    SceneGraph,
)
from clutter6d.scene_file import read_scene, write_scene
from clutter6d.seeding import generator

OBJECTS = ("target", "large_0", "small_0")


def relation(kind: RelationKind, subject: str, reference: str, second: str | None = None) -> Relation:
    return Relation(kind=kind, subject=subject, reference=reference, second_reference=second)


def on_table(*names: str) -> tuple[Relation, ...]:
    return tuple(relation("on", name, TABLE) for name in names)


def make_scene(seed: int = 0, pairs: int = 2) -> Scene:
    rng = generator(seed, "scene")
    goal_pairs: list[GoalPair] = []
    for _ in range(pairs):
        poses = np.concatenate([rng.normal(size=(4, 3)), quat_normalize(rng.normal(size=(4, 4)))], axis=1)
        goal_pairs.append(
            GoalPair(
                initial=Pose.from_row(poses[0]),
                goal=Pose.from_row(poses[3]),
                object_poses=poses[:3],
                initial_stable_index=0,
                goal_stable_index=2,
                is_path_blocked=True,
                changes_resting_face=True,
            )
        )
    return Scene(
        scene_id="sparse-0-00001",
        track="sparse",
        seed=seed,
        index=1,
        objects=tuple(
            PlacedObject(
                name=name,
                asset_name=f"mug-{index:04d}",
                asset_hash=f"{index:064x}",
                role=role,
                stable_index=index,
            )
            for index, (name, role) in enumerate(zip(OBJECTS, ("target", "large", "small"), strict=True))
        ),
        graph=SceneGraph(
            objects=OBJECTS, relations=(*on_table(*OBJECTS), relation("between", "small_0", "large_0", "target"))
        ),
        goal_pairs=tuple(goal_pairs),
        certificate=Certificate(
            max_penetration_m=1e-4,
            max_drift_m=2e-5,
            max_drift_rad=1 / 3,
            relations_hold=4,
            reachable_poses=4,
            engine_version="4.0.0",
            generator_version="0.1.0",
        ),
    )


@given(st.integers(0, 2**32))
def test_a_scene_comes_back_to_the_bit(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    path = tmp_path_factory.getbasetemp() / "scene.json"
    scene = make_scene(seed)
    write_scene(path, scene)
    returned = read_scene(path)
    for written, read in zip(scene.goal_pairs, returned.goal_pairs, strict=True):
        assert written.object_poses.tobytes() == read.object_poses.tobytes()
        assert (written.initial, written.goal) == (read.initial, read.goal)
    assert (returned.objects, returned.graph, returned.certificate) == (scene.objects, scene.graph, scene.certificate)
    assert (returned.scene_id, returned.track, returned.seed, returned.index) == ("sparse-0-00001", "sparse", seed, 1)
    assert returned.target.name == "target"


def test_writing_a_read_scene_gives_the_same_bytes(tmp_path: Path) -> None:
    write_scene(tmp_path / "a.json", make_scene())
    write_scene(tmp_path / "b.json", read_scene(tmp_path / "a.json"))
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def test_a_missing_scene_is_said_so(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match="scene file not found"):
        read_scene(tmp_path / "scene.json")


def _set(*path: str | int, value: Any) -> Callable[[dict[str, Any]], None]:
    def apply(content: dict[str, Any]) -> None:
        place: Any = content
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value

    return apply


UPSIDE_DOWN = [0.0, 0.0, 0.1, 0.0, 1.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (_set("colour", value="red"), "colour: Extra inputs are not permitted"),
        (_set("schema_version", value=2), "schema_version: Input should be 1"),
        (_set("scene_id", value="../../escape"), "scene_id: String should match pattern"),
        (_set("objects", 1, "name", value="a/b"), "objects.1.name: String should match pattern"),
        (_set("objects", 0, "asset_name", value="../mug"), "objects.0.asset_name: String should match pattern"),
        (_set("objects", 0, "asset_hash", value="abc"), "objects.0.asset_hash: String should match pattern"),
        (_set("objects", 1, "name", value="target"), "object names must be unique"),
        (_set("objects", 1, "name", value="table"), "none may be 'table'"),
        (_set("objects", 1, "role", value="target"), "the first object, and only it, must have the role 'target'"),
        (_set("objects", 0, "role", value="huge"), "objects.0.role: Input should be"),
        (_set("relations", 0, "reference", value="lamp"), "relation of 'target' names an object that is not in"),
        (_set("relations", 0, "kind", value="between"), "'between', and only it, has two references"),
        (_set("goal_pairs", value=[]), "goal_pairs: Tuple should have at least 1 item"),
        (_set("goal_pairs", 0, "object_poses", value=[UPSIDE_DOWN]), "one pose for each of the 3 objects"),
        (_set("goal_pairs", 0, "object_poses", 0, value=UPSIDE_DOWN), "must be the pair's initial pose"),
        (_set("goal_pairs", 0, "object_poses", 1, value=[0.0] * 7), "quaternion that is not unit"),
        (_set("goal_pairs", 1, "goal", "quat_wxyz", value=[1, 1, 0, 0]), "goal_pairs.1.goal: "),
        (_set("goal_pairs", 0, "initial", "position", value=[0, 0]), "goal_pairs.0.initial.position"),
        (_set("goal_pairs", 0, "initial_stable_index", value=-1), "goal_pairs.0.initial_stable_index"),
    ],
)
def test_a_scene_file_that_is_wrong_is_refused_in_one_line(
    tmp_path: Path, change: Callable[[dict[str, Any]], None], problem: str
) -> None:
    path = tmp_path / "scene.json"
    write_scene(path, make_scene())
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))
    with pytest.raises(InvalidFileError) as caught:
        read_scene(path)
    assert str(caught.value).startswith(f"{path}: not a valid scene file: ")
    assert problem in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_carries_is_placed_before_what_is_carried() -> None:
    names = ("cup", "book", "tray")
    graph = SceneGraph(
        objects=names, relations=(relation("on", "cup", "book"), relation("on", "book", "tray"), *on_table("tray"))
    )
    assert graph.placement_order() == ("tray", "book", "cup")


def test_objects_of_equal_rank_keep_their_order() -> None:
    assert SceneGraph(objects=("c", "a", "b"), relations=on_table("a", "b", "c")).placement_order() == ("c", "a", "b")


@given(st.integers(0, 2**32), st.integers(1, 12))
def test_every_tree_of_supports_can_be_placed(seed: int, count: int) -> None:
    rng = generator(seed, "tree")
    names = [f"object_{i}" for i in range(count)]
    relations = [
        relation("on", names[i], names[rng.integers(i)] if i and rng.random() < 0.6 else TABLE) for i in range(count)
    ]
    shuffled = tuple(names[i] for i in rng.permutation(count))
    order = SceneGraph(objects=shuffled, relations=tuple(relations)).placement_order()
    assert sorted(order) == sorted(names)
    for item in relations:
        assert item.reference == TABLE or order.index(item.reference) < order.index(item.subject)


def test_supports_in_a_circle_are_refused() -> None:
    circle = SceneGraph(objects=("a", "b"), relations=(relation("on", "a", "b"), relation("on", "b", "a")))
    with pytest.raises(InvalidValueError, match="cycle"):
        circle.placement_order()


@pytest.mark.parametrize("relations", [(), (*on_table("a"), relation("on", "a", "b"), *on_table("b"))])
def test_an_object_needs_exactly_one_support(relations: tuple[Relation, ...]) -> None:
    with pytest.raises(InvalidValueError, match="a needs exactly one 'on' relation"):
        SceneGraph(objects=("a", "b"), relations=relations).placement_order()


def test_only_between_has_two_references() -> None:
    with pytest.raises(InvalidValueError, match="'between', and only it, has two references"):
        relation("between", "a", "b")
    with pytest.raises(InvalidValueError, match="'between', and only it, has two references"):
        relation("near", "a", "b", "c")


def test_the_graph_has_the_table_as_its_root_and_an_edge_for_each_reference() -> None:
    graph = make_scene().graph
    network = graph.as_networkx()
    assert set(network.nodes) == {TABLE, *OBJECTS}
    assert sorted(network.out_edges(TABLE)) == [(TABLE, name) for name in sorted(OBJECTS)]
    assert sorted(network.in_edges("small_0")) == [("large_0", "small_0"), (TABLE, "small_0"), ("target", "small_0")]
    assert nx.is_directed_acyclic_graph(network)
    assert [item.kind for item in graph.of_kind("between")] == ["between"]


def test_planar_displacement_ignores_height() -> None:
    upright = (1.0, 0.0, 0.0, 0.0)
    pair = replace(
        make_scene().goal_pairs[0],
        initial=Pose(position=(0.0, 0.0, 0.0), quat_wxyz=upright),
        goal=Pose(position=(0.3, 0.4, 5.0), quat_wxyz=upright),
    )
    assert pair.planar_displacement_m == pytest.approx(0.5)
