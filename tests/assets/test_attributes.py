"""Attributes by rule, and where each came from."""

import hashlib
from dataclasses import astuple

import pytest
import trimesh

from clutter6d.assets.asset import VisualMesh
from clutter6d.assets.attributes import MASS_RANGE_KG, colour_name, derive_attributes, dominant_colour
from clutter6d.assets.name_rules import material_of
from clutter6d.assets.processing import PROCESSING_VERSION
from clutter6d.assets.sources.base import AttributeHints
from clutter6d.schema import canonical_json
from tests.assets.mesh_files import as_mesh

BOX = as_mesh(trimesh.creation.box((0.1, 0.1, 0.1)))
WHITE = (VisualMesh(mesh=BOX, rgba=(1, 1, 1, 1)),)


def derive(
    name: str, hints: AttributeHints | None = None, volume: float = 1e-3, hull: float = 1e-3
) -> tuple[object, float]:
    return derive_attributes(
        name=name, hints=hints or AttributeHints(), visual=WHITE, volume_m3=volume, hull_volume_m3=hull
    )


def test_a_vessel_weighs_the_same_whether_its_mesh_is_full_or_has_walls() -> None:
    assert derive("mug", volume=1e-3)[1] == pytest.approx(derive("mug", volume=0.2e-3)[1])


@pytest.mark.parametrize(
    ("rgba", "name"),
    [
        ((1, 0, 0), "red"), ((0, 0.6, 0.1), "green"), ((0.1, 0.2, 0.9), "blue"), ((0.95, 0.95, 0.95), "white"),
        ((0.5, 0.5, 0.5), "grey"), ((0.05, 0.05, 0.05), "black"), ((0.45, 0.28, 0.12), "brown"),
        ((1, 0.9, 0.1), "yellow"),
    ],
)  # fmt: skip
def test_colours_have_names(rgba: tuple[float, float, float], name: str) -> None:
    assert colour_name((*rgba, 1.0)) == name


def test_the_larger_surface_names_the_colour() -> None:
    small = as_mesh(trimesh.creation.box((0.02, 0.02, 0.02)))
    assert dominant_colour((*WHITE, VisualMesh(mesh=small, rgba=(1, 0, 0, 1)))) == "white"


@pytest.mark.parametrize(
    ("words", "material"),
    [
        ("coffee-mug", "ceramic"), ("plastic-cup", "plastic"), ("kitchen-knife", "metal"), ("gizmo", "plastic"),
        ("hot-dog", "food"), ("toilet-brush", "plastic"), ("bowl-with-salad", "ceramic"), ("red-apple", "food"),
        ("apple-iphone", "plastic"), ("spray-bottle", "plastic"), ("wine-bottle", "glass"), ("clothes-iron", "plastic"),
    ],
)  # fmt: skip
def test_materials_follow_names(words: str, material: str) -> None:
    assert material_of(words.split("-")) == material


def test_what_the_source_states_wins() -> None:
    hints = AttributeHints(category="cup", colour="teal", material="tin", mass_kg=0.21, friction=0.33)
    attributes, mass = derive("coffee-mug", hints)
    assert (attributes.category, attributes.colour, attributes.material) == ("cup", "teal", "tin")
    assert (attributes.friction, mass) == (0.33, 0.21)
    assert {attributes.category_from, attributes.colour_from, attributes.mass_from} == {"source"}


def test_rules_say_that_they_are_rules() -> None:
    attributes, _ = derive("hammer")
    assert {attributes.category_from, attributes.material_from, attributes.mass_from} == {"rule"}


def test_masses_are_those_of_household_things() -> None:
    assert MASS_RANGE_KG[0] <= derive("safe", volume=1e-3)[1] <= MASS_RANGE_KG[1]
    assert derive("microwave")[1] < derive("hammer")[1]
    assert derive("soccer-ball", volume=5.5e-3, hull=5.5e-3)[1] == pytest.approx(0.43, rel=0.2)
    assert derive("paper", volume=1e-9)[1] >= MASS_RANGE_KG[0]


GOLDEN_NAMES = (
    "coffee-mug bottle wine-glass teddy-bear kitchen-knife table-fan wooden-crate cardboard-box apple-iphone apples "
    "toilet-brush soccer-ball desk-lamp clothes-iron bowl-with-salad sneakers laptop candle brick houseplant gizmo"
).split()


def test_rules_have_not_changed_since_assets_were_frozen_with_them() -> None:
    """If this fails, frozen data sets of real meshes no longer verify: raise PROCESSING_VERSION, and freeze anew."""
    found = [(name, *astuple(derive(name, volume=4e-4)[0]), derive(name, volume=4e-4)[1]) for name in GOLDEN_NAMES]
    digest = hashlib.sha256(canonical_json(found)).hexdigest()
    assert (PROCESSING_VERSION, digest[:12]) == (5, "2d7be4d594cd")
