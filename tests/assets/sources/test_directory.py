"""Any folder of meshes."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from clutter6d.assets.sources.directory import DirectorySource
from clutter6d.errors import InvalidValueError, MissingFileError, UnknownNameError
from tests.assets.mesh_files import obj_text

BOX = trimesh.creation.box((100, 50, 20))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "kitchen").mkdir()
    (tmp_path / "Big Mug.obj").write_bytes(obj_text(BOX))
    (tmp_path / "kitchen" / "pan.stl").write_bytes(BOX.export(file_type="stl"))
    (tmp_path / "notes.txt").write_text("not a mesh")
    return tmp_path


def test_mesh_files_are_found_everywhere_below(folder: Path) -> None:
    items = DirectorySource(folder, licence="CC0-1.0", author="me").objects()
    assert [(item.key, item.name) for item in items] == [("Big Mug.obj", "big-mug"), ("kitchen/pan.stl", "pan")]
    assert {(item.licence.name, item.licence.author) for item in items} == {("CC0-1.0", "me")}


def test_files_of_one_name_are_told_apart(folder: Path) -> None:
    (folder / "pan.stl").write_bytes(BOX.export(file_type="stl"))
    names = [item.name for item in DirectorySource(folder).objects()]
    assert len(set(names)) == 3


@pytest.mark.parametrize(("unit", "longest"), [("m", 100), ("cm", 1), ("mm", 0.1)])
def test_the_stated_unit_is_used(folder: Path, unit: str, longest: float) -> None:
    source = DirectorySource(folder, unit=unit)
    item = source.objects()[0]
    assert item.is_metric
    assert np.ptp(source.load(item).visual[0].mesh.vertices, axis=0).max() == pytest.approx(longest)


def test_without_a_unit_the_size_is_unknown(folder: Path) -> None:
    assert not DirectorySource(folder).objects()[0].is_metric


def test_the_fingerprint_follows_content_and_options(folder: Path) -> None:
    def fingerprint(**options: str) -> str:
        source = DirectorySource(folder, **options)
        return source.fingerprint(source.objects()[0])

    before = fingerprint()
    assert fingerprint() == before
    assert len({before, fingerprint(unit="m"), fingerprint(up="z"), fingerprint(author="me")}) == 4
    (folder / "Big Mug.obj").write_bytes(obj_text(BOX.copy().apply_scale(2)))
    assert fingerprint() != before


def test_one_file_is_a_source_too(folder: Path) -> None:
    assert [item.name for item in DirectorySource(folder / "Big Mug.obj").objects()] == ["big-mug"]


def test_mistakes_are_told(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(MissingFileError):
        DirectorySource(tmp_path / "nowhere")
    with pytest.raises(UnknownNameError, match="unit 'inch'"):
        DirectorySource(folder, unit="inch")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InvalidValueError, match="holds no mesh file"):
        DirectorySource(tmp_path / "empty")
