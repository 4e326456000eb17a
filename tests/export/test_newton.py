"""An exported scene stands still in Newton, another engine; the check says so, and resumes.

Newton compiles its kernels when they are first used on a machine, which takes about a minute.
"""

import csv
import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.scene_fixtures import write_box_scene_set

pytest.importorskip("newton", reason="needs the extra 'newton'")
pytest.importorskip("newton_usd_schemas", reason="needs the extra 'newton'")

CHECK = Path(__file__).parents[2] / "examples" / "check_usd_in_newton.py"


def check(scenes: Path, out: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(CHECK), str(scenes), "--out", str(out), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_box_scene_set(tmp_path_factory.mktemp("scenes") / "set", scenes=2).path


@pytest.fixture(scope="module")
def table(scenes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The CSV of all scenes, measured in two goes, the first of which was cut short in the middle of a row."""
    out = tmp_path_factory.mktemp("drift") / "drift.csv"
    first = check(scenes, out, "--limit", "1")
    assert first.returncode == 0, first.stdout + first.stderr
    with out.open("a") as file:
        file.write("boxes-1,4,0,5e-")
    done = check(scenes, out)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 of 2 scenes: validators silent, MJCF and USD equal, still in both engines" in done.stdout
    return out


def test_scenes_stand_still_in_newton_as_in_mujoco(table: Path) -> None:
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert [row["scene_id"] for row in rows] == ["boxes-0", "boxes-1"]
    for row in rows:
        assert max(float(row[name]) for name in ("newton_mm", "newton_deg", "mujoco_mm", "mujoco_deg")) < 0.3
        assert (row["validator_reports"], row["objects"]) == ("0", "4")


def test_newton_puts_every_link_and_object_where_mujoco_has_it(table: Path) -> None:
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert all(float(row["start_mm"]) < 1e-3 for row in rows)


def test_an_object_that_falls_is_reported(tmp_path: Path) -> None:
    scene = next(write_box_scene_set(tmp_path / "set", scenes=1).path.glob("scenes/*/scene.json"))
    content = json.loads(scene.read_text())
    assert content["objects"][3]["name"] == "small_1"
    content["goal_pairs"][0]["object_poses"][3][2] += 0.05
    scene.write_text(json.dumps(content))
    done = check(tmp_path / "set", tmp_path / "drift.csv")
    assert done.returncode == 1
    assert "small_1" in done.stdout
    assert "0 of 1 scenes" in done.stdout
