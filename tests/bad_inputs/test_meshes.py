"""A folder of broken meshes goes through ``assets process``: each is judged by itself, and the good ones are kept."""

from pathlib import Path

import pytest

from clutter6d.assets.library import AssetLibrary, ProcessingRecord
from tests.bad_inputs.harness import Outcome, fingerprint, run_command
from tests.bad_inputs.meshes import ACCEPTED, BROKEN_MESHES, GOOD_MESHES, SKIPPED, BrokenMesh

SECRET = "the content of a file outside"


def process(source: Path, library: Path, *options: str) -> Outcome:
    return run_command(["assets", "process", str(source), "--out", str(library), "--seconds", "5", *options])


def reason_of(record: ProcessingRecord) -> str:
    return record.reason or record.status


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """The folder; beside it, where a mesh must not reach, a file."""
    outside = tmp_path_factory.mktemp("meshes")
    path = outside / "a" / "b"
    path.mkdir(parents=True)
    for name in ("secret.txt", "secret.mtl"):
        (outside / name).write_text(SECRET)
    for mesh in BROKEN_MESHES:
        mesh.put(path)
    for name, content in GOOD_MESHES.items():
        (path / name).write_bytes(content)
    for name, put in SKIPPED.items():
        put(path / name)
    return path


@pytest.fixture(scope="module")
def processed(folder, tmp_path_factory) -> tuple[Outcome, AssetLibrary]:
    path = tmp_path_factory.mktemp("libraries") / "library"
    return process(folder, path), AssetLibrary.open(path)


@pytest.fixture(scope="module")
def records(processed) -> dict[str, ProcessingRecord]:
    return {record.key: record for record in processed[1].records()}


@pytest.mark.parametrize("mesh", BROKEN_MESHES, ids=lambda mesh: mesh.name)
def test_a_broken_mesh_is_rejected_with_its_reason(mesh: BrokenMesh, records) -> None:
    record = records[mesh.key]
    assert reason_of(record) in mesh.reasons, f"{reason_of(record)}: {record.detail}"
    assert (record.status == "accepted") == (not record.detail), "what is rejected says what was found"
    assert "\n" not in record.detail
    assert SECRET not in record.detail
    assert "root:" not in record.detail


def test_the_run_succeeds_and_reports_every_reason(processed) -> None:
    outcome, library = processed
    assert (outcome.code, outcome.err) == (0, "")
    assert {
        record.reason
        for record in library.records()
        if record.status == "rejected" and record.reason not in outcome.out
    } == set()


def test_the_good_meshes_become_assets_that_verify(processed, records) -> None:
    _, library = processed
    assert {name: records[name].status for name in GOOD_MESHES} == dict.fromkeys(GOOD_MESHES, "accepted")
    assert library.verify() == ()


def test_an_accepted_mesh_has_a_solid_and_a_way_to_rest(processed, records) -> None:
    _, library = processed
    for mesh in BROKEN_MESHES:
        if records[mesh.key].status == "accepted":
            asset = library.load(records[mesh.key].asset_hash)
            assert asset.parts, mesh.name
            assert asset.mass_properties.mass_kg > 0
            assert len(asset.stable.heights_m) > 0
            assert mesh.reasons[0] == ACCEPTED or ACCEPTED in mesh.reasons


def test_what_is_no_mesh_file_is_left_alone(records) -> None:
    assert records.keys() == {*(mesh.key for mesh in BROKEN_MESHES), *GOOD_MESHES}


def test_a_second_run_changes_nothing(folder, processed) -> None:
    _, library = processed
    before = fingerprint(library.path)
    assert process(folder, library.path).code == 0
    assert fingerprint(library.path) == before
