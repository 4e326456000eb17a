"""The command, from a sample to a plan."""

import re
from pathlib import Path

import pytest

from clutter6d.cli import run
from clutter6d.estimate.measurement import spread
from tests.assets.mesh_files import l_bracket, obj_text
from tests.box_library import make_box_library


def test_a_sample_becomes_a_plan(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    library = make_box_library(tmp_path / "library")
    meshes = tmp_path / "meshes"
    meshes.mkdir()
    for index in range(4):
        (meshes / f"bracket-{index}.obj").write_bytes(obj_text(l_bracket().apply_scale(1 + index / 10)))
    (meshes / "broken.obj").write_bytes(b"")
    sample = ["--source", str(meshes), "--sample-assets", "4", "--sample-scenes", "2", "--track", "sparse"]
    wanted = ["--library", str(library.path), "--assets", "1000", "--scenes", "2000", "--workers", "8"]
    assert run(["estimate", *sample, *wanted]) == 0
    told = capsys.readouterr().out
    assert re.search(r"tried that succeed\W+80%\W+100%", told)
    assert re.search(r"assets\W+1,000\W+1,250\W", told)
    assert re.search(r"scenes\W+2,000\W+2,000\W", told)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["library", "meshes"]


def test_a_sample_is_spread_over_the_source() -> None:
    assert spread(range(100), 4) == [0, 33, 66, 99]
    assert spread(range(3), 9) == [0, 1, 2]
    assert spread(range(3), 1) == [0]
