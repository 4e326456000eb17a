"""The command ``clutter6d play``, started and stopped as a person does."""

import os
import re
import signal
import subprocess
import urllib.request
from pathlib import Path

import pytest

from tests.bad_inputs.harness import COMMAND, run_process
from tests.scene_fixtures import write_box_scene_set


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("play") / "scenes"
    write_box_scene_set(path)
    return path


def test_the_page_is_served_until_it_is_interrupted(scenes: Path) -> None:
    arguments = ["play", "--policy", "zero", "--scenes", str(scenes), "--viewer", "web", "--no-browser"]
    process = subprocess.Popen([*COMMAND, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    line = process.stdout.readline()
    address = re.search(r"http://127\.0\.0\.1:\d+", line)
    assert address, line
    with urllib.request.urlopen(address[0], timeout=10) as page:
        assert b"<html" in page.read()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert (process.returncode, out) == (130, "")
    assert err.splitlines() == ["interrupted; what was finished is kept"]


def test_without_viser_the_command_says_what_to_install(scenes: Path, tmp_path: Path) -> None:
    (tmp_path / "viser.py").write_text("raise ImportError('not here')")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = run_process(
        ["play", "--policy", "zero", "--scenes", str(scenes), "--viewer", "web", "--no-browser"], env=environment
    )
    assert done.code == 2
    assert done.err == 'error: the web viewer needs viser; run: pip install "clutter6d[play]"\n'
