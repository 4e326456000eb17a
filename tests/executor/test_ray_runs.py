"""Commands on Ray: an actor is killed, then the driver; the next run ends the work, to the bytes of a local run."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest

from clutter6d.cli import run
from tests.box_library import make_box_library
from tests.executor.trees import tree
from tests.scene_fixtures import write_box_scene_set

pytestmark = pytest.mark.slow
pytest.importorskip("ray", reason='needs pip install "clutter6d[ray]"')

COMMAND = (sys.executable, "-c", "from clutter6d.cli import main; main()")
ON_RAY = ("--executor", "ray", "--workers", "2")
ACTOR = "ray::RayWorker"


@dataclass(frozen=True, kw_only=True, slots=True)
class Work:
    """A command that takes a while.

    Attributes:
        command: Its arguments, for a folder of inputs and one of outputs.
        progress: Files of which each is one finished piece of the work.
    """

    command: Callable[[Path, Path], Sequence[str]]
    progress: str


def process(_inputs: Path, out: Path) -> Sequence[str]:
    return ["assets", "process", "procedural", "--limit", "40", "--out", str(out)]


def generate(inputs: Path, out: Path) -> Sequence[str]:
    library = ["--library", str(inputs / "library")]
    return ["generate", "--track", "sparse", "--scenes", "12", "--out", str(out), *library]


def evaluate(inputs: Path, out: Path) -> Sequence[str]:
    scenes = ["--scenes", str(inputs / "scenes"), "--num-envs", "1"]
    return ["evaluate", "--policy", "random", *scenes, "--out", str(out)]


WORKS = {
    "assets-process": Work(command=process, progress="records/*.json"),
    "generate": Work(command=generate, progress="scenes/*/scene.json"),
    "evaluate": Work(command=evaluate, progress="journal/*.json"),
}


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("inputs")
    make_box_library(folder / "library")
    write_box_scene_set(folder / "scenes")
    return folder


@pytest.fixture(params=WORKS)
def work(request: pytest.FixtureRequest) -> Work:
    return WORKS[request.param]


def test_killing_an_actor_and_then_the_driver_loses_nothing(work: Work, inputs: Path, tmp_path: Path) -> None:
    here, there = tmp_path / "local", tmp_path / "ray"
    assert run([*work.command(inputs, here), "--workers", "2"]) == 0
    on_ray = [*COMMAND, *work.command(inputs, there), *ON_RAY]
    with subprocess.Popen(on_ray, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as driver:
        wait_for_pieces(work, there, 1, driver)
        victim = next(actors(driver))
        victim.kill()
        wait_for_pieces(work, there, len(pieces(work, there)) + 1, driver)
        family = [child for child in psutil.Process(driver.pid).children(recursive=True) if "Agent" not in child.name()]
        driver.kill()
    kept = {path: path.stat().st_mtime_ns for path in pieces(work, there)}
    _, alive = psutil.wait_procs(family, timeout=60)
    assert not alive, "workers outlive their driver"
    done = subprocess.run(on_ray, capture_output=True, text=True, check=False, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    assert {path: path.stat().st_mtime_ns for path in kept} == kept, "finished pieces were made again"
    assert tree(there) == tree(here)


def test_an_interrupted_run_says_so_in_one_line(work: Work, inputs: Path, tmp_path: Path) -> None:
    arguments = [*COMMAND, *work.command(inputs, tmp_path / "ray"), *ON_RAY]
    with subprocess.Popen(
        arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as driver:  # fmt: skip
        wait_for_pieces(work, tmp_path / "ray", 1, driver)
        os.killpg(driver.pid, signal.SIGINT)
        _, err = driver.communicate(timeout=60)
    assert (driver.returncode, err) == (130, "interrupted; what was finished is kept\n")


def pieces(work: Work, out: Path) -> list[Path]:
    return sorted(out.glob(work.progress))


def wait_for_pieces(work: Work, out: Path, count: int, driver: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 200
    while len(pieces(work, out)) < count:
        assert driver.poll() is None, driver.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.01)


def actors(driver: subprocess.Popen[str]) -> Iterator[psutil.Process]:
    for process_ in psutil.Process(driver.pid).children(recursive=True):
        if " ".join(process_.cmdline()).startswith(ACTOR):
            yield process_
