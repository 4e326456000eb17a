"""Libraries by name: made once, found again, and refused by another name."""

from pathlib import Path

import pytest

from clutter6d.assets import cache, named_libraries
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.named_libraries import open_library
from clutter6d.errors import UnknownNameError


def test_the_built_in_library_is_made_once_with_progress(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cache.CACHE_VARIABLE, str(tmp_path))
    monkeypatch.setattr(named_libraries, "DEFAULT_OBJECTS", 2)
    seen: list[tuple[int, int]] = []
    first = open_library("procedural", on_progress=lambda done, total: seen.append((done, total)))
    assert seen == [(1, 2), (2, 2)]
    assert len(first.names()) == 2
    assert open_library("procedural").path == first.path


def test_a_folder_is_opened_as_it_is(tmp_path: Path) -> None:
    library = AssetLibrary.create(tmp_path / "mine")
    assert open_library(str(tmp_path / "mine")).path == library.path


def test_another_name_is_refused_with_a_suggestion() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'procedural'"):
        open_library("proceduril")


def test_an_empty_library_has_a_table(tmp_path: Path) -> None:
    library = AssetLibrary.create(tmp_path / "empty")
    assert library.index().empty
    assert "size_class" in library.index().columns
