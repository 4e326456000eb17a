"""The examples do what they say, on scenes made for the purpose."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from clutter6d.export.mjcf import export_mjcf
from clutter6d.scenegen.generation import generate_scenes, open_for_generation
from clutter6d.scenegen.scene_set import SceneSet
from clutter6d.scenegen.track import find_track
from tests.box_library import make_box_library

CHECK = Path(__file__).parent.parent / "examples" / "check_exported_scenes.py"


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One sparse scene of boxes, exported."""
    folder, track = tmp_path_factory.mktemp("exported"), find_track("sparse")
    library = make_box_library(folder / "library")
    made = open_for_generation(library, track, 0, folder / "scenes")
    assert list(generate_scenes(library, track, 0, made, range(1)))
    scene_set = SceneSet.open(made.path)
    scene = scene_set.scenes[0]
    export_mjcf(scene, scene_set.assets_of(scene), made.path / "mjcf" / scene.scene_id)
    return made.path


def check(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, str(CHECK), str(folder)], capture_output=True, text=True, check=False)


def test_exported_certificates_hold_in_plain_mujoco(exported: Path) -> None:
    done = check(exported)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 of 1 certificates hold" in done.stdout


def test_the_check_notices_a_scene_that_was_tampered_with(exported: Path) -> None:
    path = next(exported.glob("mjcf/*/scene.xml"))
    before = path.read_text()
    gravity = re.sub(r"<option ", '<option gravity="3 0 -9.81" ', before, count=1)
    path.write_text(gravity)
    try:
        done = check(exported)
    finally:
        path.write_text(before)
    assert done.returncode == 1
    assert "moved" in done.stdout
