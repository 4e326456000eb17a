"""Good inputs to be spoiled, made once; and the count of the cases."""

import shutil

import pytest

from clutter6d.assets.library import AssetLibrary
from clutter6d.eval.cli import SCENES_FILE, ScenesLocation
from clutter6d.schema import write_model
from tests.bad_inputs.harness import Workspace, run_command
from tests.box_library import make_box_library
from tests.scene_fixtures import write_box_scene_set


@pytest.fixture(scope="session")
def pristine(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """A library, a set of scenes and an evaluation in which nothing is wrong."""
    path = tmp_path_factory.mktemp("pristine")
    made = Workspace(path=path, library=path / "library", scenes=path / "scenes", results=path / "results")
    make_box_library(made.library, large=2, small=3)
    write_box_scene_set(made.scenes)
    done = run_command(
        ["evaluate", "--policy", "zero", "--scenes", str(made.scenes), "--out", str(made.results), "--max-steps", "3"]
    )
    assert done.code == 0, done.err
    assert AssetLibrary.open(made.library).verify() == ()
    return made


@pytest.fixture
def workspace(pristine: Workspace, tmp_path) -> Workspace:
    """A copy of it for one test."""
    path = tmp_path / "workspace"
    shutil.copytree(pristine.path, path)
    write_model(path / "results" / SCENES_FILE, ScenesLocation(scenes=str(path / "scenes")))
    return Workspace(path=path, library=path / "library", scenes=path / "scenes", results=path / "results")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print how many bad inputs were tried."""
    reports = [
        report
        for outcome in ("passed", "failed")
        for report in terminalreporter.stats.get(outcome, [])
        if report.when == "call" and "bad_inputs/" in report.nodeid and "[" in report.nodeid
    ]
    if reports:
        terminalreporter.write_line(f"bad inputs: {len(reports)} cases")
