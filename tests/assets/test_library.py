"""The library: content-addressed, checked on reading, unharmed by kills and full disks."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clutter6d.assets.asset import Asset
from clutter6d.assets.asset_file import ARRAYS_NAME, JSON_NAME
from clutter6d.assets.library import AssetLibrary, ProcessingRecord
from clutter6d.errors import Clutter6DError, InvalidFileError, InvalidValueError, MissingFileError, UnknownNameError


@pytest.fixture
def library(tmp_path: Path, brick: Asset, bracket: Asset) -> AssetLibrary:
    library = AssetLibrary.create(tmp_path / "library", {"seed": 0})
    library.add(brick)
    library.add(bracket)
    return library


def folder_of(library: AssetLibrary, name: str) -> Path:
    return next((library.path / "assets").glob(f"{name}-*"))


def record(**changes: object) -> ProcessingRecord:
    fields = {"fingerprint": "ab" * 16, "source": "s", "key": "k", "name": "n", "status": "rejected", "seconds": 0.1}
    return ProcessingRecord(**fields | changes)


def test_an_asset_comes_back_to_the_bit(library: AssetLibrary, bracket: Asset) -> None:
    loaded = AssetLibrary.open(library.path).load("bracket")
    assert loaded.content_hash == bracket.content_hash
    assert loaded.quality == bracket.quality
    assert loaded.licence == bracket.licence
    np.testing.assert_array_equal(loaded.stable.quats_wxyz, bracket.stable.quats_wxyz)
    for one, other in zip(loaded.parts, bracket.parts, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)


def test_an_asset_is_found_by_name_and_by_hash(library: AssetLibrary, brick: Asset) -> None:
    assert library.names() == ("bracket", "brick")
    for key in ("brick", brick.content_hash, brick.content_hash[:12]):
        assert library.load(key).name == "brick"


def test_an_unknown_name_suggests_the_nearest(library: AssetLibrary) -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'brick'"):
        library.load("brik")


def test_the_index_has_a_row_an_asset(library: AssetLibrary) -> None:
    index = library.index()
    assert list(index["name"]) == ["bracket", "brick"]
    assert {"content_hash", "size_class", "mass_kg", "parts", "licence", "author", "source_id"} <= set(index.columns)


def test_a_changed_mass_is_noticed(library: AssetLibrary) -> None:
    path = folder_of(library, "brick") / JSON_NAME
    path.write_text(json.dumps(json.loads(path.read_text()) | {"mass_kg": 0.001}))
    with pytest.raises(InvalidFileError, match="content has hash"):
        library.load("brick")
    assert len(library.verify()) == 1


def test_a_changed_array_is_noticed(library: AssetLibrary) -> None:
    path = folder_of(library, "brick") / ARRAYS_NAME
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(InvalidFileError):
        library.load("brick")


@pytest.mark.parametrize("text", ["", "{}", "[]", "not json", '{"unknown": 1}'])
def test_a_damaged_description_is_one_clear_error(library: AssetLibrary, text: str) -> None:
    (folder_of(library, "brick") / JSON_NAME).write_text(text)
    with pytest.raises(InvalidFileError, match="not a valid asset file"):
        library.load("brick")
    assert library.load("bracket").name == "bracket"


def test_missing_geometry_is_reported(library: AssetLibrary) -> None:
    (folder_of(library, "brick") / ARRAYS_NAME).unlink()
    assert "asset geometry not found" in library.verify()[0]


def test_a_half_written_asset_does_not_count(library: AssetLibrary) -> None:
    (folder_of(library, "brick") / JSON_NAME).unlink()
    assert AssetLibrary.open(library.path).names() == ("bracket",)


def test_another_object_of_the_same_name_gets_its_own(library: AssetLibrary, bracket: Asset) -> None:
    licence = replace(bracket.licence, source_id="another")
    added = library.add(replace(bracket, name="brick", licence=licence))
    assert added.name == f"brick-{bracket.content_hash[:6]}"
    assert len(library.names()) == 3


def test_a_new_version_of_an_object_replaces_the_old(library: AssetLibrary, brick: Asset) -> None:
    newer = replace(brick, content_hash="0" * 64)
    library.add(newer)
    assert AssetLibrary.open(library.path).names() == ("bracket", "brick")
    assert folder_of(library, "brick").name.endswith("0" * 12)


def test_records_come_back(library: AssetLibrary) -> None:
    rejected = record(reason="empty", detail="nothing there", fallbacks=("a", "b"))
    library.add_record(rejected)
    assert library.record(rejected.fingerprint) == rejected
    assert library.records() == (rejected,)
    assert library.record("cd" * 16) is None


def test_a_record_without_its_asset_counts_as_not_done(library: AssetLibrary) -> None:
    library.add_record(record(status="accepted", asset_name="gone", asset_hash="1" * 64))
    assert library.record("ab" * 16) is None
    assert "which is not there" in library.verify()[0]


def test_other_settings_need_another_library(library: AssetLibrary) -> None:
    assert AssetLibrary.create(library.path, {"seed": 0}).names() == library.names()
    with pytest.raises(InvalidValueError, match="other settings \\(seed\\)"):
        AssetLibrary.create(library.path, {"seed": 1})


def test_a_folder_of_other_things_is_not_taken_over(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("important")
    with pytest.raises(InvalidValueError, match="neither empty nor"):
        AssetLibrary.create(tmp_path)


def test_a_folder_without_library_file_is_no_library(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match="assets process"):
        AssetLibrary.open(tmp_path)


def test_a_folder_that_cannot_be_written_is_one_clear_error(tmp_path: Path, brick: Asset) -> None:
    library = AssetLibrary.create(tmp_path / "library")
    (library.path / "assets").write_text("a file where a folder should be")
    with pytest.raises(Clutter6DError, match="cannot write"):
        library.add(brick)
