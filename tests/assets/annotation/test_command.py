"""The command ``clutter6d assets annotate``, with pictures, an endpoint, and kills."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from clutter6d.assets.annotation.memory import FOLDER
from clutter6d.assets.library import AssetLibrary
from clutter6d.cli import DEBUG_VARIABLE, run
from tests.assets.annotation.endpoint_server import KEY, MODEL, EndpointServer, Said, good, serve
from tests.assets.annotation.test_run import name_in

PATIENCE_S = 150
"""For a command to start and draw; far less than the server is silent."""


@pytest.fixture(autouse=True)
def _environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    monkeypatch.setenv("CLUTTER6D_VLM_MODEL", MODEL)
    monkeypatch.delenv("OPENAI_BASE_URL", raising=False)


def command(library: AssetLibrary, server: EndpointServer, *options: str) -> list[str]:
    return ["assets", "annotate", str(library.path), "--by", "vlm", "--base-url", server.url, *options]


def test_by_rule_needs_nothing(library: AssetLibrary, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["assets", "annotate", str(library.path)]) == 0
    assert "4 of 4 assets annotated" in capsys.readouterr().out
    assert library.verify() == ()
    assert run(["assets", "annotate", str(library.path)]) == 0
    assert "0 of 4 assets annotated" in capsys.readouterr().out


def test_by_model_shows_pictures_and_what_it_cost(library: AssetLibrary, capsys: pytest.CaptureFixture[str]) -> None:
    with serve(good()) as server:
        prices = ("--price-in", "1", "--price-out", "2", "--limit", "2")
        assert run(command(library, server, *prices)) == 0
    said = capsys.readouterr().out
    assert f"asking {MODEL} at {server.url}" in said
    assert "2 asked for, 0 remembered" in said
    assert "0.0024" in said
    first, second = (question["messages"][1]["content"][1:] for question in server.questions)
    assert len({part["image_url"]["url"] for part in (*first, *second)}) == 8
    assert min(len(part["image_url"]["url"]) for part in first) > 2000


def test_the_key_is_neither_written_nor_said(
    library: AssetLibrary, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(DEBUG_VARIABLE, "1")
    with serve(good()) as server:
        assert run(command(library, server, "--limit", "1")) == 0
    files = [path for path in library.path.rglob("*") if path.is_file()]
    captured = capsys.readouterr()
    assert server.keys == [f"Bearer {KEY}"]
    assert KEY not in captured.out + captured.err
    assert all(KEY.encode() not in path.read_bytes() for path in files)


def test_killed_in_the_middle_nothing_is_lost_and_nothing_asked_twice(library: AssetLibrary) -> None:
    is_third_asked = threading.Event()

    def hang_at_the_third(question: dict) -> Said:
        if len(server.questions) == 3:
            is_third_asked.set()
            return Said(text=None, delay_s=300.0)
        return good()

    with serve(hang_at_the_third) as server:
        arguments = command(library, server, "--concurrency", "1")
        script = "from clutter6d.cli import main; main()"
        process = subprocess.Popen([sys.executable, "-c", script, *arguments], stdout=subprocess.DEVNULL)
        try:
            assert is_third_asked.wait(PATIENCE_S)
        finally:
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
        assert len(list(Path(library.path, FOLDER).iterdir())) == 2
        assert AssetLibrary.open(library.path).verify() == ()
        assert run(arguments) == 0
    assert [name_in(question) for question in server.questions] == ["box-0", "box-1", "box-2", "box-2", "box-3"]
    annotated = AssetLibrary.open(library.path)
    assert {annotated.load(name).attributes.mass_from for name in annotated.names()} == {"vlm"}
    assert annotated.verify() == ()


def test_interrupted_it_stops_at_once_and_goes_on_later(library: AssetLibrary) -> None:
    is_asked = threading.Event()

    def hang_once(question: dict) -> Said:
        if len(server.questions) == 1:
            is_asked.set()
            return Said(text=None, delay_s=300.0)
        return good()

    with serve(hang_once) as server:
        arguments = command(library, server, "--concurrency", "1")
        script = "from clutter6d.cli import main; main()"
        process = subprocess.Popen([sys.executable, "-c", script, *arguments], stderr=subprocess.PIPE, text=True)
        assert is_asked.wait(PATIENCE_S)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=PATIENCE_S)
        assert process.returncode == 130
        assert "interrupted; what was finished is kept" in said
        assert "Traceback" not in said
        assert run(arguments) == 0
