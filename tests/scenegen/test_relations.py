"""Relations: what each one means, seen from the robot at -x."""

import numpy as np
import pytest

from clutter6d.scene import TABLE, Relation, RelationKind, SceneGraph
from clutter6d.scenegen.footprint import DIRECTIONS, Layout, empty_layout
from clutter6d.scenegen.relations import RelationRules, broken_relations, candidates_fulfil, describe

SQUARE = (0.03 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ DIRECTIONS.T).max(axis=0)
RULES = RelationRules()


def layout(**positions: tuple[float, float]) -> Layout:
    made = empty_layout()
    for name, position in positions.items():
        made = made.with_object(name, np.array(position, dtype=float), SQUARE, 0.06)
    return made


@pytest.mark.parametrize(
    ("kind", "position"),
    [
        ("left_of", (0.0, 0.2)),
        ("right_of", (0.0, -0.2)),
        ("in_front_of", (-0.2, 0.0)),
        ("behind", (0.2, 0.0)),
    ],
)
def test_a_direction_holds_on_its_side_and_on_no_other(kind: RelationKind, position: tuple[float, float]) -> None:
    scene = layout(cup=(0.0, 0.0), box=position)
    held = {item.kind for item in describe(scene.names, "box", scene, RULES)} - {"on", "near"}
    assert held == {kind}


def test_near_is_a_matter_of_the_gap_not_of_the_centres() -> None:
    relation = Relation(kind="near", subject="box", reference="cup")
    gaps = np.array([[0.06 + 0.079, 0.0], [0.06 + 0.081, 0.0]])
    assert candidates_fulfil(relation, gaps, SQUARE[None], layout(cup=(0.0, 0.0)), RULES).tolist() == [True, False]


def test_between_means_beside_the_middle_of_the_line() -> None:
    relation = Relation(kind="between", subject="box", reference="cup", second_reference="jar")
    positions = np.array([[0.2, 0.05], [0.2, 0.15], [0.02, 0.0], [0.5, 0.0]])
    scene = layout(cup=(0.0, 0.0), jar=(0.4, 0.0))
    held = candidates_fulfil(relation, positions, SQUARE[None], scene, RULES)
    assert held.tolist() == [True, False, False, False]


def test_slack_makes_a_relation_harder_to_fulfil() -> None:
    relation = Relation(kind="near", subject="box", reference="cup")
    position = np.array([[0.06 + 0.079, 0.0]])
    scene = layout(cup=(0.0, 0.0))
    assert not candidates_fulfil(relation, position, SQUARE[None], scene, RULES, slack_m=0.002)[0]


def test_a_broken_relation_is_named() -> None:
    on_table = tuple(Relation(kind="on", subject=name, reference=TABLE) for name in ("cup", "box"))
    behind = Relation(kind="behind", subject="box", reference="cup")
    graph = SceneGraph(objects=("cup", "box"), relations=(*on_table, behind))
    supporters = {"cup": frozenset({TABLE}), "box": frozenset({TABLE})}
    assert broken_relations(graph, layout(cup=(0, 0), box=(0.2, 0)), supporters, RULES) == ()
    assert broken_relations(graph, layout(cup=(0, 0), box=(-0.2, 0)), supporters, RULES) == (behind,)
    floating = {**supporters, "box": frozenset({"cup"})}
    assert broken_relations(graph, layout(cup=(0, 0), box=(0.2, 0)), floating, RULES) == (on_table[1],)
