"""Tasks in Ray actors: the same results and failures as locally, and what is lost with a worker is done by another."""

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from tests.executor.ray_session import KINDS

ROOT = Path(__file__).resolve().parents[2]
pytest.importorskip("ray", reason='needs pip install "clutter6d[ray]"')


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("ray")
    command = [sys.executable, "-m", "tests.executor.ray_session", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("REPORT "), f"Ray printed into the progress bar: {done.stdout}"
    return {**json.loads(done.stdout.removeprefix("REPORT ")), "stderr": done.stderr}


def test_every_item_has_one_result(session: dict[str, Any]) -> None:
    assert sorted(session["squares"]) == [[item, item**2, None, None] for item in range(20)]


def test_a_task_that_dies_takes_nothing_with_it(session: dict[str, Any]) -> None:
    kinds = {item: kind for item, _, kind, _ in session["misbehaving"]}
    assert kinds == {"good": None, "aborts": "crash", "hangs": "timeout", "eats-memory": "memory", "raises": "error"}
    details = {item: detail for item, _, _, detail in session["misbehaving"]}
    assert details["aborts"] == "exit code -6"
    assert details["raises"] == "ZeroDivisionError: in the loader"
    assert set(details) == set(KINDS)


def test_an_actor_that_is_killed_loses_nothing_and_nothing_is_done_twice(session: dict[str, Any]) -> None:
    results, log = session["killed"]["results"], session["killed"]["log"]
    assert sorted(results) == [[item, item**2, None, None] for item in range(8)]
    events = Counter(what for what, *_ in log)
    assert events == {"start": 8 + 1, "end": 8}


def test_an_item_that_gets_its_workers_killed_is_a_crash(session: dict[str, Any]) -> None:
    results = {item: (value, kind) for item, value, kind, _ in session["always"]}
    assert results == {"victim": (None, "crash"), "bystander": ("bystander", None)}


def test_an_item_that_loses_its_actor_is_given_to_another(session: dict[str, Any]) -> None:
    assert sorted(session["parent"]) == [["bystander", "bystander", None, None], ["victim", "victim", None, None]]


def test_a_result_that_cannot_be_sent_is_an_error(session: dict[str, Any]) -> None:
    ((_, _, kind, detail),) = session["unpicklable"]
    assert kind == "error"
    assert "cannot be sent" in detail


def test_a_function_that_workers_cannot_import_is_one_clear_error(session: dict[str, Any]) -> None:
    assert "a worker cannot load its task" in session["not_importable"]
    assert "\n" not in session["not_importable"]


def test_ray_is_quiet_and_listens_on_this_machine_only(session: dict[str, Any]) -> None:
    assert set(session["listening"]) <= {"127.0.0.1", "::1", "::ffff:127.0.0.1"}
    assert session["stderr"] == ""
