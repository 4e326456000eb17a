"""Drawing a scene graph for a track: every obstacle stands on the table and in relation to earlier ones."""

import numpy as np

from clutter6d.scene import TABLE, Relation, RelationKind, SceneGraph
from clutter6d.scenegen.relations import DIRECTIONAL
from clutter6d.scenegen.track import Track

RELATED_SHARE = 0.8
"""Share of obstacles, after the first, that a relation ties to earlier ones."""

_KINDS: tuple[RelationKind, ...] = ("near", *DIRECTIONAL, "between")


def draw_scene_graph(track: Track, rng: np.random.Generator) -> SceneGraph:
    """A random graph over a track's objects: ``on`` the table for all, and spatial relations among the obstacles.

    Obstacles appear in random order, and each refers only to obstacles before it, so the graph can be placed in order.
    The target has no spatial relation, since it stands elsewhere in every goal pair.
    """
    obstacles = [track.obstacle_names[index] for index in rng.permutation(len(track.obstacle_names))]
    relations = [Relation(kind="on", subject=name, reference=TABLE) for name in ("target", *obstacles)]
    for count, name in enumerate(obstacles):
        if count and rng.random() < RELATED_SHARE:
            relations.append(_draw_relation(name, obstacles[:count], rng))
    return SceneGraph(objects=("target", *obstacles), relations=tuple(relations))


def _draw_relation(subject: str, earlier: list[str], rng: np.random.Generator) -> Relation:
    kinds = _KINDS if len(earlier) > 1 else _KINDS[:-1]
    kind = kinds[rng.integers(len(kinds))]
    shuffled = [earlier[index] for index in rng.permutation(len(earlier))]
    second = shuffled[1] if kind == "between" else None
    return Relation(kind=kind, subject=subject, reference=shuffled[0], second_reference=second)
