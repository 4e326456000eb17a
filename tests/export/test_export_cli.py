"""``clutter6d export``: a scene, a folder of scenes or a split, in any formats."""

from pathlib import Path

import pytest

from clutter6d.export.formats import FORMATS, parse_formats
from tests.bad_inputs.harness import run_command
from tests.scene_fixtures import write_box_scene_set

FILES = {"mjcf": "scene.xml", "usd": "scene.usd", "usdz": "scene.usdz", "glb": "scene.glb"}


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_box_scene_set(tmp_path_factory.mktemp("scenes") / "set").path


def export(scenes: Path, formats: str, out: Path) -> set[str]:
    outcome = run_command(["export", str(scenes), "--format", formats, "--out", str(out)])
    assert (outcome.code, outcome.err) == (0, "")
    return {str(path.relative_to(out)) for path in out.rglob("scene.*")}


def test_a_folder_of_scenes_is_exported_in_every_format(scenes: Path, tmp_path: Path) -> None:
    assert set(FILES) == set(FORMATS)
    expected = {f"{name}/boxes-{index}/{file}" for name, file in FILES.items() for index in range(2)}
    assert export(scenes, "mjcf,usd, usdz,GLB", tmp_path) == expected


def test_one_scene_of_a_folder_is_exported(scenes: Path, tmp_path: Path) -> None:
    assert export(scenes / "scenes" / "boxes-1", "glb", tmp_path) == {"glb/boxes-1/scene.glb"}


def test_licences_lie_in_every_folder(scenes: Path, tmp_path: Path) -> None:
    export(scenes, "mjcf,glb", tmp_path)
    assert len(list(tmp_path.rglob("LICENCES.csv"))) == 4


def test_exporting_again_changes_nothing(scenes: Path, tmp_path: Path) -> None:
    export(scenes, "mjcf,usd,usdz,glb", tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.*")}
    export(scenes, "mjcf,usd,usdz,glb", tmp_path)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*.*")} == before


def test_a_scene_of_a_frozen_split_is_exported(tmp_path: Path) -> None:
    outcome = run_command(["export", "sparse-test/sparse-2-00003", "--format", "usd", "--out", str(tmp_path)])
    assert (outcome.code, outcome.err) == (0, "")
    assert (tmp_path / "usd" / "sparse-2-00003" / "scene.usd").is_file()


def test_formats_are_each_done_once() -> None:
    assert parse_formats("usd, mjcf,USD") == ("usd", "mjcf")
