"""The shared vocabulary: Scene, PlacedObject, SceneGraph, GoalPair.

World frame: origin at the centre of the table top, z up, x away from the robot. Metres, radians, ``wxyz``.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import networkx as nx
import numpy as np
from jaxtyping import Float64

from clutter6d.errors import InvalidValueError
from clutter6d.geometry import Pose

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
