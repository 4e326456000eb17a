"""Sources by name."""

from pathlib import Path

import pytest
import trimesh

from clutter6d.assets.sources.registry import make_source, source_names
from clutter6d.errors import InvalidValueError, UnknownNameError


def test_built_in_sources_are_registered() -> None:
    assert {"procedural", "directory", "furniture_catalogue", "objaverse", "random_urdfs"} <= set(source_names())


def test_a_source_is_made_by_name_with_its_options(tmp_path: Path) -> None:
    (tmp_path / "box.stl").write_bytes(trimesh.creation.box().export(file_type="stl"))
    assert make_source("directory", path=tmp_path, unit="mm").name == "directory"


def test_a_limit_is_told_to_sources_that_count() -> None:
    assert len(make_source("procedural", limit=3).objects()) == 3


def test_unknown_names_and_options_are_told() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'procedural'"):
        make_source("proceduarl")
    with pytest.raises(InvalidValueError, match="does not take 'flavour'"):
        make_source("procedural", flavour="mint")
