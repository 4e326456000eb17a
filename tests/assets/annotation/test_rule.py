"""The annotator that needs nothing but the asset."""

from pathlib import Path

import pytest
import trimesh

from clutter6d.assets.annotation.annotator import Subject
from clutter6d.assets.annotation.plan import ATTRIBUTES, AnnotationSettings, names_to_annotate
from clutter6d.assets.annotation.rule import RuleAnnotator
from clutter6d.assets.annotation.run import annotate_library
from clutter6d.assets.annotation.volume import hull_volume_m3, plausible_mass_range_kg, solid_volume_m3
from clutter6d.assets.asset import Asset
from clutter6d.assets.attribute_change import AttributeChange, changed_asset
from clutter6d.assets.library import AssetLibrary
from tests.assets.annotation.conftest import box_by_rule
from tests.assets.conftest import process
from tests.assets.mesh_files import as_shape


def suggest(asset: Asset, *opened: str) -> AttributeChange:
    return RuleAnnotator().annotate(Subject(asset=asset, open=frozenset(opened or ATTRIBUTES))).change


def test_a_box_has_the_volume_of_a_box() -> None:
    box = box_by_rule("box", (0.2, 0.1, 0.05))
    assert solid_volume_m3(box) == pytest.approx(1e-3, rel=1e-5)
    assert hull_volume_m3(box) == pytest.approx(1e-3, rel=1e-5)


def test_a_mass_may_be_anything_from_a_shell_to_a_full_body() -> None:
    low, high = plausible_mass_range_kg(box_by_rule("box", (0.1, 0.1, 0.1)), "steel")
    assert low == pytest.approx(0.1125, rel=1e-3)
    assert high == pytest.approx(10.125, rel=1e-3)


def test_the_name_gives_material_mass_and_friction() -> None:
    change = suggest(box_by_rule("wooden-block", (0.1, 0.1, 0.1)))
    assert (change.material, change.friction) == ("wood", 0.5)
    assert change.mass_kg == pytest.approx(0.65, rel=1e-3)


def test_what_is_not_open_is_gone_by() -> None:
    asset = changed_asset(box_by_rule("thing"), AttributeChange(category="mug", colour="teal"), by="person")
    change = suggest(asset, "material", "mass_kg", "friction")
    assert (change.category, change.colour, change.material) == ("mug", "teal", "ceramic")


def test_an_asset_just_processed_has_nothing_to_change(tmp_path: Path, brick: Asset, bracket: Asset) -> None:
    library = AssetLibrary.create(tmp_path / "library")
    for asset in (brick, bracket, process(as_shape(trimesh.creation.icosphere(radius=0.05)), name="soccer-ball")):
        library.add(asset)
    settings = AnnotationSettings()
    outcomes = list(
        annotate_library(library, names_to_annotate(library, settings), RuleAnnotator(), lambda _: (), settings)
    )
    assert [outcome.status for outcome in outcomes] == ["unchanged"] * 3
