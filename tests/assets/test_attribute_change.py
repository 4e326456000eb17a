"""Changing what is said of an asset, and storing the changed version in the old one's place."""

import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from clutter6d.assets import library as library_module
from clutter6d.assets.asset import Asset, hash_asset
from clutter6d.assets.attribute_change import AttributeChange, changed_asset
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.processing import ProcessingSettings
from clutter6d.assets.run import RunSettings, run, settings_as_stored
from clutter6d.errors import InvalidValueError, UnknownNameError
from tests.assets.conftest import ShapeSource
from tests.assets.mesh_files import as_shape


@pytest.fixture(scope="module")
def processed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("processed") / "library"
    library = AssetLibrary.create(path, settings_as_stored(ProcessingSettings()))
    assert [record.status for record in process_boxes(library)] == ["accepted", "accepted"]
    return path


@pytest.fixture
def library(tmp_path: Path, processed: Path) -> AssetLibrary:
    return AssetLibrary.open(shutil.copytree(processed, tmp_path / "library"))


def process_boxes(library: AssetLibrary) -> list:
    box = trimesh.creation.box
    source = ShapeSource({"a": as_shape(box((0.12, 0.08, 0.04))), "b": as_shape(box((0.2, 0.08, 0.04)))})
    items = tuple(replace(item, name=f"box-{item.key}") for item in source.objects())
    return list(run(source, items, library, ProcessingSettings(), RunSettings()))


def heavier(asset: Asset) -> Asset:
    return changed_asset(asset, AttributeChange(mass_kg=2 * asset.mass_properties.mass_kg), by="person")


class Killed(BaseException):
    """Stands for the process's end."""


def killed(*_: object, **__: object) -> None:
    raise Killed


def test_what_is_given_changes_and_says_by_whom(brick: Asset) -> None:
    changed = changed_asset(brick, AttributeChange(category="brick", friction=0.7), by="vlm")
    assert (changed.attributes.category, changed.attributes.friction) == ("brick", 0.7)
    assert (changed.attributes.category_from, changed.attributes.friction_from) == ("vlm", "vlm")


def test_what_is_not_given_stays(brick: Asset) -> None:
    changed = changed_asset(brick, AttributeChange(category="brick", friction=0.7), by="vlm").attributes
    kept = replace(
        changed,
        category=brick.attributes.category,
        category_from=brick.attributes.category_from,
        friction=brick.attributes.friction,
        friction_from=brick.attributes.friction_from,
    )
    assert kept == brick.attributes


def test_inertia_scales_with_mass(brick: Asset) -> None:
    changed = heavier(brick)
    assert changed.mass_properties.mass_kg == 2 * brick.mass_properties.mass_kg
    np.testing.assert_allclose(changed.mass_properties.inertia, 2 * brick.mass_properties.inertia)
    assert changed.attributes.mass_from == "person"


def test_the_hash_is_that_of_the_new_content(brick: Asset) -> None:
    changed = heavier(brick)
    assert changed.content_hash == hash_asset(changed) != brick.content_hash


def test_a_confirmed_value_is_the_persons(brick: Asset) -> None:
    changed = changed_asset(brick, AttributeChange(colour=brick.attributes.colour), by="person")
    assert changed.attributes.colour_from == "person"
    assert changed.content_hash != brick.content_hash


def test_no_change_is_the_same_asset(brick: Asset) -> None:
    assert changed_asset(brick, AttributeChange(), by="person").content_hash == brick.content_hash


@pytest.mark.parametrize(
    "values",
    [
        {"mass_kg": 0.0}, {"mass_kg": -1.0}, {"mass_kg": 50.1}, {"mass_kg": math.nan}, {"mass_kg": math.inf},
        {"friction": 0.0}, {"friction": 4.1}, {"category": ""}, {"category": " mug"}, {"colour": "red\n"},
        {"colour": "\x1b[31mred"}, {"material": "x" * 61},
    ],
)  # fmt: skip
def test_values_out_of_range_are_refused(values: dict[str, object]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(values))):
        AttributeChange(**values)


def test_a_change_knows_what_it_brings_and_can_be_narrowed() -> None:
    change = AttributeChange(category="mug", mass_kg=0.3)
    assert change.given == ("category", "mass_kg")
    assert change.only("mass_kg", "friction") == AttributeChange(mass_kg=0.3)


def test_the_new_version_stands_in_the_old_ones_place(library: AssetLibrary) -> None:
    old = library.load("box-a")
    stored = library.replace(old.content_hash, heavier(old))
    assert AssetLibrary.open(library.path).load("box-a").content_hash == stored.content_hash
    assert library.names() == ("box-a", "box-b")
    assert len(list((library.path / "assets").iterdir())) == 2
    assert library.verify() == ()


def test_processing_again_leaves_the_new_version_alone(library: AssetLibrary) -> None:
    old = library.load("box-a")
    stored = library.replace(old.content_hash, heavier(old))
    hashes = {record.asset_name: record.asset_hash for record in process_boxes(AssetLibrary.open(library.path))}
    assert hashes["box-a"] == stored.content_hash
    assert AssetLibrary.open(library.path).load("box-a").attributes.mass_from == "person"


def test_a_change_can_be_taken_back(library: AssetLibrary) -> None:
    old = library.load("box-a")
    new = library.replace(old.content_hash, heavier(old))
    library.replace(new.content_hash, old)
    assert AssetLibrary.open(library.path).load("box-a").content_hash == old.content_hash
    assert library.verify() == ()


def test_a_change_of_a_version_that_is_gone_is_refused(library: AssetLibrary) -> None:
    old = library.load("box-a")
    AssetLibrary.open(library.path).replace(old.content_hash, heavier(old))
    with pytest.raises(UnknownNameError):
        library.replace(old.content_hash, changed_asset(old, AttributeChange(colour="red"), by="person"))


def test_replacing_by_the_same_changes_nothing(library: AssetLibrary) -> None:
    old = library.load("box-a")
    assert library.replace(old.content_hash, old).content_hash == old.content_hash
    assert library.verify() == ()


@pytest.mark.parametrize(
    ("where", "what", "is_new"),
    [
        (library_module, "write_asset", False),
        (AssetLibrary, "_supersede", True),
        (AssetLibrary, "add_record", True),
        (AssetLibrary, "_remove", True),
        (shutil, "rmtree", True),
    ],
)
def test_a_kill_leaves_the_old_or_the_new_and_the_next_call_clears_up(
    library: AssetLibrary, monkeypatch: pytest.MonkeyPatch, where: object, what: str, is_new: bool
) -> None:
    old, new = library.load("box-a"), heavier(library.load("box-a"))
    with monkeypatch.context() as patch:
        patch.setattr(where, what, killed)
        with pytest.raises(Killed):
            library.replace(old.content_hash, new)
    reopened = AssetLibrary.open(library.path)
    found = reopened.load("box-a")
    assert found.content_hash == (new if is_new else old).content_hash
    assert reopened.verify() == ()
    last = reopened.replace(found.content_hash, changed_asset(found, AttributeChange(colour="red"), by="person"))
    assert {record.asset_hash for record in process_boxes(reopened)} >= {last.content_hash}
    assert AssetLibrary.open(library.path).verify() == ()
    whole = list((library.path / "assets").glob("*/asset.json"))
    assert len(whole) == 2


def test_adding_another_asset_clears_up_too(library: AssetLibrary, monkeypatch: pytest.MonkeyPatch) -> None:
    old = library.load("box-a")
    with monkeypatch.context() as patch:
        patch.setattr(AssetLibrary, "_supersede", killed)
        with pytest.raises(Killed):
            library.replace(old.content_hash, heavier(old))
    library.add(library.load("box-b"))
    assert library.verify() == ()
    assert len(list((library.path / "assets").iterdir())) == 2
