"""The commands: their output, their exit codes, one line for a mistake."""

from pathlib import Path

import pytest
import trimesh

from clutter6d.cli import run
from tests.assets.mesh_files import l_bracket, obj_text


@pytest.fixture
def library(tmp_path: Path) -> Path:
    folder = tmp_path / "meshes"
    folder.mkdir()
    (folder / "bracket.obj").write_bytes(obj_text(l_bracket()))
    (folder / "box.stl").write_bytes(trimesh.creation.box((0.1, 0.05, 0.03)).export(file_type="stl"))
    (folder / "broken.glb").write_bytes(b"glTF")
    assert run(["assets", "process", str(folder), "--out", str(tmp_path / "library"), "--unit", "m"]) == 0
    return tmp_path / "library"


def test_process_again_list_show_and_verify(library: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = str(library.parent / "meshes")
    assert run(["assets", "process", folder, "--out", str(library), "--unit", "m"]) == 0
    assert "2 of 3 objects became assets" in capsys.readouterr().out
    assert run(["assets", "list", "--library", str(library)]) == 0
    assert "bracket" in capsys.readouterr().out
    assert run(["assets", "show", "box", "--library", str(library)]) == 0
    assert "unstated" in capsys.readouterr().out
    assert run(["assets", "verify", "--library", str(library)]) == 0
    assert "2 assets and 3 records verified" in capsys.readouterr().out


def test_a_damaged_library_fails_verification(library: Path, capsys: pytest.CaptureFixture[str]) -> None:
    next((library / "assets").glob("box-*/geometry.npz")).write_bytes(b"")
    assert run(["assets", "verify", "--library", str(library)]) == 2
    captured = capsys.readouterr()
    assert "1 problems found" in captured.err
    assert "not a valid asset geometry" in captured.out


MISTAKES = {
    "an unknown source": ["process", "objavrse", "--out", "x"],
    "a folder that is not there": ["process", "./not-there", "--out", "x"],
    "the directory source without a folder": ["process", "directory", "--out", "x"],
    "an unknown unit": ["process", ".", "--out", "x", "--unit", "inch"],
    "a folder without meshes": ["process", "empty", "--out", "x"],
    "an option that the source does not take": ["process", "procedural", "--out", "x", "--unit", "m"],
    "no worker": ["process", "procedural", "--out", "x", "--workers", "0"],
    "a library that is not there": ["list", "--library", "x"],
    "an output folder of other things": ["process", "procedural", "--limit", "1", "--out", "full"],
    "an unknown axis": ["process", "meshes", "--out", "x", "--up", "sideways"],
}


@pytest.mark.parametrize("arguments", MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_is_one_line_and_exit_code_2(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("empty", "full", "meshes"):
        (tmp_path / folder).mkdir()
    (tmp_path / "full" / "thesis.tex").write_text("important")
    (tmp_path / "meshes" / "bracket.obj").write_bytes(obj_text(l_bracket()))
    assert run(["assets", *arguments]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
    assert not (tmp_path / "x").exists()
