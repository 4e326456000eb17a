"""Spatial relations as predicates on layouts, for one placement or for many candidates at once.

Directions are the robot's: it looks along +x, so left is +y, and what is in front of an object is nearer to the robot.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from clutter6d.scene import TABLE, Relation, RelationKind, SceneGraph
from clutter6d.scenegen.footprint import Layout, separations_m

DIRECTIONAL: dict[RelationKind, tuple[float, float]] = {
    "left_of": (0.0, 1.0),
    "right_of": (0.0, -1.0),
    "in_front_of": (-1.0, 0.0),
    "behind": (1.0, 0.0),
}
"""Direction from the reference to the subject; the relation holds within 45 degrees of it."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RelationRules:
    """When a relation holds; lengths in metres.

    Attributes:
        near_gap_m: Largest free distance between footprints that are near.
        reach_m: Largest distance between the centres of a directional relation: farther, it says nothing.
        between_off_axis_m: Largest distance of the subject's centre from the line between the two references.
        between_share: Part of that line, from end to end, beside which the subject must stand.
        resting_gap_m: Largest gap between an object's lowest point and the table it rests on.
    """

    near_gap_m: float = 0.08
    reach_m: float = 0.45
    between_off_axis_m: float = 0.10
    between_share: tuple[float, float] = (0.2, 0.8)
    resting_gap_m: float = 0.002


def candidates_fulfil(
    relation: Relation,
    positions: Float64[np.ndarray, "n 2"],
    supports: Float64[np.ndarray, "#n direction"],
    layout: Layout,
    rules: RelationRules,
    *,
    slack_m: float = 0.0,
) -> Bool[np.ndarray, "n"]:
    """Which candidate placements of the subject fulfil a planar relation with objects of a layout.

    Args:
        relation: Any relation but ``on`` an object, which is not planar; ``on`` the table always holds here.
        positions: Candidate positions of the subject.
        supports: Its footprint's support function at each candidate.
        layout: Where the references stand.
        rules: Thresholds.
        slack_m: How far inside the thresholds to stay, so that settling cannot break the relation.
    """
    if relation.kind == "on":
        return np.ones(len(positions), dtype=bool)
    reference = layout.index(relation.reference)
    offset = positions - layout.positions[reference]
    if relation.kind == "near":
        gap = separations_m(positions, supports, layout.only(relation.reference))[:, 0]
        return gap <= rules.near_gap_m - slack_m
    if relation.kind == "between":
        return _is_between(relation, positions, layout, rules, slack_m)
    along_x, along_y = DIRECTIONAL[relation.kind]
    forward = offset[:, 0] * along_x + offset[:, 1] * along_y
    sideways = np.abs(offset[:, 0] * along_y - offset[:, 1] * along_x)
    return (forward >= sideways + slack_m) & (np.hypot(offset[:, 0], offset[:, 1]) <= rules.reach_m - slack_m)


def _is_between(
    relation: Relation, positions: Float64[np.ndarray, "n 2"], layout: Layout, rules: RelationRules, slack_m: float
) -> Bool[np.ndarray, "n"]:
    start = layout.positions[layout.index(relation.reference)]
    axis = layout.positions[layout.index(str(relation.second_reference))] - start
    length = max(float(np.hypot(axis[0], axis[1])), 1e-9)
    unit = axis / length
    offset = positions - start
    along = offset[:, 0] * unit[0] + offset[:, 1] * unit[1]
    off_axis = np.abs(offset[:, 0] * unit[1] - offset[:, 1] * unit[0])
    low, high = (share * length for share in rules.between_share)
    return (along >= low + slack_m) & (along <= high - slack_m) & (off_axis <= rules.between_off_axis_m - slack_m)


def broken_relations(
    graph: SceneGraph,
    layout: Layout,
    supporters: dict[str, frozenset[str]],
    rules: RelationRules,
) -> tuple[Relation, ...]:
    """Relations of a graph that do not hold.

    Args:
        graph: What should hold.
        layout: Where the objects are.
        supporters: For each object, what it rests on: names of objects, or the table.
        rules: Thresholds.
    """
    return tuple(relation for relation in graph.relations if not _holds(relation, layout, supporters, rules))


def _holds(relation: Relation, layout: Layout, supporters: dict[str, frozenset[str]], rules: RelationRules) -> bool:
    if relation.kind == "on":
        return relation.reference in supporters[relation.subject]
    subject = layout.index(relation.subject)
    fulfilled = candidates_fulfil(
        relation, layout.positions[subject, None], layout.supports[subject, None], layout, rules
    )
    return bool(fulfilled[0])


def describe(names: Sequence[str], subject: str, layout: Layout, rules: RelationRules) -> tuple[Relation, ...]:
    """All planar relations that hold between a subject and other objects: a pose, told as a graph.

    A goal pose described so is the paper's task-oriented form of a goal.
    """
    kinds: tuple[RelationKind, ...] = ("near", *DIRECTIONAL)
    candidates = [
        Relation(kind=kind, subject=subject, reference=name) for name in names if name != subject for kind in kinds
    ]
    on_table = Relation(kind="on", subject=subject, reference=TABLE)
    return (on_table, *(item for item in candidates if _holds(item, layout, {}, rules)))
