"""The shared vocabulary: Scene, PlacedObject, SceneGraph, GoalPair, and their file.

World frame: origin at the centre of the table top, z up, x away from the robot. Metres, radians, ``wxyz``.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

import networkx as nx
import numpy as np
from jaxtyping import Float64
from pydantic import Field, model_validator

from clutter6d.errors import InvalidValueError
from clutter6d.geometry import Pose, is_unit
from clutter6d.schema import FileModel, read_model, write_model

TABLE = "table"
TABLE_SIZE_M = (1.0, 1.4)
Role = Literal["target", "large", "small"]
RelationKind = Literal["on", "near", "left_of", "right_of", "in_front_of", "behind", "between"]


@dataclass(frozen=True, kw_only=True, slots=True)
class PlacedObject:
    """An asset in a scene.

    Attributes:
        name: Name within the scene, for instance ``"target"`` or ``"large_0"``.
        asset_name: Name of the asset in its library.
        asset_hash: Content hash of the asset; what the scene really depends on.
        role: Target, large obstacle or small obstacle.
        stable_index: Index of the stable orientation it was placed in.
    """

    name: str
    asset_name: str
    asset_hash: str
    role: Role
    stable_index: int


@dataclass(frozen=True, kw_only=True, slots=True)
class Relation:
    """``subject`` stands in relation ``kind`` to ``reference`` (and to ``second_reference`` for ``between``)."""

    kind: RelationKind
    subject: str
    reference: str
    second_reference: str | None = None

    def __post_init__(self) -> None:
        """Refuse a relation with a wrong number of references."""
        if (self.kind == "between") != (self.second_reference is not None):
            raise InvalidValueError(
                f"relation '{self.kind}' of {self.subject}: 'between', and only it, has two references"
            )


@dataclass(frozen=True, kw_only=True, slots=True)
class SceneGraph:
    """Relations between placed objects and the table (paper, "Environment Setup": task-oriented scene graph)."""

    objects: tuple[str, ...]
    relations: tuple[Relation, ...]

    def as_networkx(self) -> nx.MultiDiGraph:
        """Nodes are object names and the table; an edge from reference to subject is a relation."""
        graph = nx.MultiDiGraph()
        graph.add_nodes_from((TABLE, *self.objects))
        for relation in self.relations:
            for reference in filter(None, (relation.reference, relation.second_reference)):
                graph.add_edge(reference, relation.subject, kind=relation.kind)
        return graph

    def placement_order(self) -> tuple[str, ...]:
        """Objects in topological order: what carries an object, or is referred to by its relations, comes before it.

        Raises:
            InvalidValueError: An object has no support, or the relations form a cycle.
        """
        supports = [relation.subject for relation in self.of_kind("on")]
        unsupported = [name for name in self.objects if supports.count(name) != 1]
        if unsupported:
            raise InvalidValueError(f"scene graph: {unsupported[0]} needs exactly one 'on' relation")
        graph = self.as_networkx()
        if not nx.is_directed_acyclic_graph(graph):
            raise InvalidValueError("scene graph: the relations form a cycle; refer only to objects placed earlier")
        rank = {name: index for index, name in enumerate((TABLE, *self.objects))}
        order = nx.lexicographical_topological_sort(graph, key=lambda name: rank[name])
        return tuple(name for name in order if name != TABLE)

    def of_kind(self, kind: RelationKind) -> Iterator[Relation]:
        """The relations of one kind."""
        return (relation for relation in self.relations if relation.kind == kind)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class GoalPair:
    """One task in a scene: where the target starts and where it must go.

    Attributes:
        initial: The target's settled initial pose.
        goal: The target's settled goal pose.
        object_poses: Settled poses of all placed objects at the start; the target's row equals ``initial``.
        initial_stable_index: Index of the stable orientation of the initial pose.
        goal_stable_index: Index of the stable orientation of the goal pose.
        is_path_blocked: Whether an obstacle overlaps the straight path of the target's footprint.
        changes_resting_face: Whether the goal rests on another face than the start.
    """

    initial: Pose
    goal: Pose
    object_poses: Float64[np.ndarray, "object 7"]
    initial_stable_index: int
    goal_stable_index: int
    is_path_blocked: bool
    changes_resting_face: bool

    @property
    def planar_displacement_m(self) -> float:
        """Distance between initial and goal position on the table plane."""
        return float(np.hypot(*(np.subtract(self.goal.position, self.initial.position)[:2])))


@dataclass(frozen=True, kw_only=True, slots=True)
class Certificate:
    """Evidence that a scene is valid: worst case over its goal pairs.

    Attributes:
        max_penetration_m: Deepest contact at the stored states.
        max_drift_m: Largest displacement of an object within 1 s of simulation from a stored state.
        max_drift_rad: Largest rotation within the same second.
        relations_hold: Number of relations checked and true at every stored state.
        reachable_poses: Initial and goal poses for which a collision-free hover pose was found.
        engine_version: MuJoCo's version.
        generator_version: Version of this package.
    """

    max_penetration_m: float
    max_drift_m: float
    max_drift_rad: float
    relations_hold: int
    reachable_poses: int
    engine_version: str
    generator_version: str


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Scene:
    """Placed objects with settled poses, their graph, and the tasks posed in it.

    Attributes:
        scene_id: Unique name, for instance ``"moderate-0-00012"``.
        track: Track name.
        seed: The user's seed.
        index: The scene's number under that seed.
        objects: The target first, then the obstacles.
        graph: Relations that hold between the obstacles and the table.
        goal_pairs: The tasks.
        certificate: Evidence of validity.
    """

    scene_id: str
    track: str
    seed: int
    index: int
    objects: tuple[PlacedObject, ...]
    graph: SceneGraph
    goal_pairs: tuple[GoalPair, ...]
    certificate: Certificate

    @property
    def target(self) -> PlacedObject:
        """The object to be moved; always the first."""
        return self.objects[0]


_NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$"
"""Names become file names, so they hold nothing that leaves a folder."""


class _PoseModel(FileModel):
    position: tuple[float, float, float]
    quat_wxyz: tuple[float, float, float, float]

    @model_validator(mode="after")
    def _check_unit(self) -> "_PoseModel":
        if not is_unit(np.array(self.quat_wxyz)):
            raise ValueError("quaternion is not unit")
        return self


Row = tuple[float, float, float, float, float, float, float]


class _PairModel(FileModel):
    initial: _PoseModel
    goal: _PoseModel
    object_poses: tuple[Row, ...]
    initial_stable_index: int = Field(ge=0)
    goal_stable_index: int = Field(ge=0)
    is_path_blocked: bool
    changes_resting_face: bool


class _ObjectModel(FileModel):
    name: str = Field(pattern=_NAME)
    asset_name: str = Field(pattern=_NAME)
    asset_hash: str = Field(pattern="^[0-9a-f]{64}$")
    role: Role
    stable_index: int = Field(ge=0)


class _RelationModel(FileModel):
    kind: RelationKind
    subject: str
    reference: str
    second_reference: str | None = None


class _CertificateModel(FileModel):
    max_penetration_m: float
    max_drift_m: float
    max_drift_rad: float
    relations_hold: int
    reachable_poses: int
    engine_version: str
    generator_version: str


class SceneFile(FileModel):
    """A scene as stored: ``scene.json``, schema version 1."""

    schema_version: Literal[1] = 1
    scene_id: str = Field(pattern=_NAME)
    track: str
    seed: int
    index: int = Field(ge=0)
    objects: tuple[_ObjectModel, ...] = Field(min_length=1, max_length=64)
    relations: tuple[_RelationModel, ...]
    goal_pairs: tuple[_PairModel, ...] = Field(min_length=1, max_length=1024)
    certificate: _CertificateModel

    @model_validator(mode="after")
    def _check_consistency(self) -> "SceneFile":
        names = [item.name for item in self.objects]
        if len(set(names)) != len(names) or TABLE in names:
            raise ValueError("object names must be unique and none may be 'table'")
        if self.objects[0].role != "target" or any(item.role == "target" for item in self.objects[1:]):
            raise ValueError("the first object, and only it, must have the role 'target'")
        known = {*names, TABLE}
        for relation in self.relations:
            if not {relation.subject, relation.reference, relation.second_reference or TABLE} <= known:
                raise ValueError(f"relation of '{relation.subject}' names an object that is not in the scene")
        if any((item.kind == "between") != (item.second_reference is not None) for item in self.relations):
            raise ValueError("'between', and only it, has two references")
        if any(len(pair.object_poses) != len(names) for pair in self.goal_pairs):
            raise ValueError(f"every goal pair needs one pose for each of the {len(names)} objects")
        if any(pair.object_poses[0] != (*pair.initial.position, *pair.initial.quat_wxyz) for pair in self.goal_pairs):
            raise ValueError("the first object's pose must be the pair's initial pose")
        if not all(is_unit(np.array(pair.object_poses)[:, 3:]).all() for pair in self.goal_pairs):
            raise ValueError("a stored object pose has a quaternion that is not unit")
        return self


def read_scene(path: Path) -> Scene:
    """Read ``scene.json``.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is not a valid scene.
    """
    file = read_model(path, SceneFile, what="scene file")
    names = tuple(item.name for item in file.objects)
    return Scene(
        scene_id=file.scene_id,
        track=file.track,
        seed=file.seed,
        index=file.index,
        objects=tuple(PlacedObject(**item.model_dump()) for item in file.objects),
        graph=SceneGraph(objects=names, relations=tuple(Relation(**item.model_dump()) for item in file.relations)),
        goal_pairs=tuple(_pair_from_model(item) for item in file.goal_pairs),
        certificate=Certificate(**file.certificate.model_dump()),
    )


def write_scene(path: Path, scene: Scene) -> None:
    """Write ``scene.json`` atomically; poses round-trip to the bit."""
    write_model(path, scene_to_file(scene))


def scene_to_file(scene: Scene) -> SceneFile:
    """The stored form of a scene."""
    return SceneFile(
        scene_id=scene.scene_id,
        track=scene.track,
        seed=scene.seed,
        index=scene.index,
        objects=tuple(_ObjectModel(**_slots(item)) for item in scene.objects),
        relations=tuple(_RelationModel(**_slots(item)) for item in scene.graph.relations),
        goal_pairs=tuple(_pair_to_model(item) for item in scene.goal_pairs),
        certificate=_CertificateModel(**_slots(scene.certificate)),
    )


def _slots(item: PlacedObject | Relation | Certificate) -> dict[str, Any]:
    return {field.name: getattr(item, field.name) for field in fields(item)}


def _pose_to_model(pose: Pose) -> _PoseModel:
    return _PoseModel(position=pose.position, quat_wxyz=pose.quat_wxyz)


def _pose_from_model(model: _PoseModel) -> Pose:
    return Pose(position=model.position, quat_wxyz=model.quat_wxyz)


def _pair_to_model(pair: GoalPair) -> _PairModel:
    return _PairModel(
        initial=_pose_to_model(pair.initial),
        goal=_pose_to_model(pair.goal),
        object_poses=tuple(_row(row) for row in pair.object_poses),
        initial_stable_index=pair.initial_stable_index,
        goal_stable_index=pair.goal_stable_index,
        is_path_blocked=pair.is_path_blocked,
        changes_resting_face=pair.changes_resting_face,
    )


def _pair_from_model(model: _PairModel) -> GoalPair:
    return GoalPair(
        initial=_pose_from_model(model.initial),
        goal=_pose_from_model(model.goal),
        object_poses=np.array(model.object_poses, dtype=np.float64),
        initial_stable_index=model.initial_stable_index,
        goal_stable_index=model.goal_stable_index,
        is_path_blocked=model.is_path_blocked,
        changes_resting_face=model.changes_resting_face,
    )


def _row(values: Sequence[float] | np.ndarray) -> Row:
    x, y, z, qw, qx, qy, qz = (float(value) for value in values)
    return (x, y, z, qw, qx, qy, qz)
