"""A whole source: nothing crashes the run, nothing finished is done twice, everything is on record."""

from collections.abc import Callable
from pathlib import Path

import pytest

from clutter6d.assets.library import AssetLibrary, ProcessingRecord
from clutter6d.assets.processing import ProcessingSettings
from clutter6d.assets.run import RunSettings, run, settings_as_stored
from clutter6d.assets.sources.base import AssetSource
from clutter6d.assets.sources.directory import DirectorySource
from tests.assets.conftest import ShapeSource
from tests.assets.mesh_files import l_bracket, obj_text
from tests.assets.misbehaving_source import MisbehavingSource
from tests.assets.self_destructing_source import SelfDestructingSource

SETTINGS = ProcessingSettings()


@pytest.fixture
def run_into(tmp_path: Path) -> Callable[..., dict[str, ProcessingRecord]]:
    def run_source(source: AssetSource, **changes: object) -> dict[str, ProcessingRecord]:
        library = AssetLibrary.create(tmp_path / "library", settings_as_stored(SETTINGS))
        records = run(source, source.objects(), library, SETTINGS, RunSettings(**{"seconds": 8} | changes))
        return {record.name: record for record in records}

    return run_source


def test_every_object_is_on_record_whatever_it_does(run_into: Callable[..., dict[str, ProcessingRecord]]) -> None:
    records = run_into(MisbehavingSource(), seconds=2)
    reasons = {name: record.reason for name, record in records.items()}
    assert reasons == {
        "good": "", "aborts": "crashed", "hangs": "timed-out", "eats-memory": "out-of-memory", "raises": "failed",
    }  # fmt: skip
    assert records["good"].status == "accepted"
    assert "ZeroDivisionError" in records["raises"].detail


def test_a_crash_in_the_decomposition_falls_back_to_the_hull(
    run_into: Callable[..., dict[str, ProcessingRecord]], tmp_path: Path
) -> None:
    record = run_into(SelfDestructingSource())["bracket"]
    assert record.status == "accepted"
    assert record.fallbacks == (
        "decomposition:normal-crashed", "decomposition:coarse-crashed", "decomposition:hull",
    )  # fmt: skip
    asset = AssetLibrary.open(tmp_path / "library").load("bracket")
    assert asset.quality.fallbacks == record.fallbacks


def test_a_second_run_only_does_what_is_left(
    run_into: Callable[..., dict[str, ProcessingRecord]], tmp_path: Path
) -> None:
    folder = tmp_path / "meshes"
    folder.mkdir()
    (folder / "bracket.obj").write_bytes(obj_text(l_bracket()))
    (folder / "broken.obj").write_bytes(b"")
    first = run_into(DirectorySource(folder, unit="m"))
    assets = sorted((tmp_path / "library").rglob("geometry.npz"))
    times = [path.stat().st_mtime_ns for path in assets]
    (folder / "second.obj").write_bytes(obj_text(l_bracket()))
    second = run_into(DirectorySource(folder, unit="m"))
    assert {name: second[name] for name in first} == first
    assert second["second"].status == "accepted"
    assert [path.stat().st_mtime_ns for path in assets] == times
    assert AssetLibrary.open(tmp_path / "library").verify() == ()


def test_results_do_not_depend_on_the_number_of_workers(tmp_path: Path) -> None:
    folder = tmp_path / "meshes"
    folder.mkdir()
    for index in range(3):
        (folder / f"bracket-{index}.obj").write_bytes(obj_text(l_bracket().apply_scale(1 + index)))
    hashes = []
    for workers in (1, 2):
        library = AssetLibrary.create(tmp_path / f"library-{workers}", settings_as_stored(SETTINGS))
        source = DirectorySource(folder)
        list(run(source, source.objects(), library, SETTINGS, RunSettings(workers=workers)))
        hashes.append([library.describe(name).content_hash for name in library.names()])
    assert len(hashes[0]) == 3
    assert hashes[0] == hashes[1]


def test_no_objects_make_an_empty_library(run_into: Callable[..., dict[str, ProcessingRecord]]) -> None:
    assert run_into(ShapeSource({})) == {}
