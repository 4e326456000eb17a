"""A full disk at any write, a kill or Ctrl-C in the middle: nothing is lost, and the next run ends what is left."""

import errno
import os
import resource
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from clutter6d.assets.library import AssetLibrary
from tests.bad_inputs.boxes import CORNERS, obj
from tests.bad_inputs.harness import COMMAND, Workspace, check_refusal, fingerprint, run_command, run_process

FULL = "No space left on device; nothing earlier was changed"


@dataclass(frozen=True, kw_only=True, slots=True)
class Work:
    """A command that takes a while.

    Attributes:
        command: Its arguments, for an output folder.
        progress: Files of which each is one finished piece of the work.
        result: What the finished work must be, whatever happened on the way.
    """

    command: Callable[[Workspace, Path], Sequence[str]]
    progress: str
    result: Callable[[Path], Mapping[str, Any]]


def process(work: Workspace, out: Path) -> Sequence[str]:
    folder = work.path / "meshes"
    if not folder.exists():
        folder.mkdir()
        for index in range(4):
            (folder / f"box-{index}.obj").write_bytes(obj(CORNERS * [1 + index / 10, 1, 1]))
    return ["assets", "process", str(folder), "--out", str(out), "--unit", "m", "--workers", "2"]


def generate(work: Workspace, out: Path) -> Sequence[str]:
    library = ["--library", str(work.library)]
    return ["generate", "--track", "sparse", "--scenes", "3", "--out", str(out), "--workers", "2", *library]


def evaluate(work: Workspace, out: Path) -> Sequence[str]:
    options = ["--max-steps", "40", "--num-envs", "1", "--threads", "1"]
    return ["evaluate", "--policy", "random", "--scenes", str(work.scenes), "--out", str(out), *options]


def library_of(out: Path) -> Mapping[str, Any]:
    library = AssetLibrary.open(out)
    assert library.verify() == ()
    return {path.parent.name: path.read_bytes() for path in out.glob("assets/*/geometry.npz")} | {
        record.key: record.asset_hash for record in library.records()
    }


def scenes_of(out: Path) -> Mapping[str, Any]:
    found = fingerprint(out)
    return {name: content for name, content in found.items() if not name.endswith(("generation.json", ".partial"))}


def tables_of(out: Path) -> Mapping[str, Any]:
    rows = pd.read_parquet(out / "episodes.parquet").drop(columns="timing_seconds").to_dict("records")
    files = ("actions.parquet", "report.json", "report.md", "run.json")
    return {"rows": rows} | {name: (out / name).read_bytes() for name in files}


WORKS = {
    "assets-process": Work(command=process, progress="records/*.json", result=library_of),
    "generate": Work(command=generate, progress="scenes/*/scene.json", result=scenes_of),
    "evaluate": Work(command=evaluate, progress="journal/*.json", result=tables_of),
}


@pytest.fixture(scope="module")
def finished(pristine: Workspace) -> Callable[[str], Mapping[str, Any]]:
    """What each work comes to when nothing goes wrong; made when first asked for."""
    results: dict[str, Mapping[str, Any]] = {}

    def result_of(name: str) -> Mapping[str, Any]:
        if name not in results:
            out = pristine.path.parent / f"finished-{name}"
            outcome = run_command(serial(WORKS[name].command(pristine, out)))
            assert outcome.code == 0, outcome.err
            results[name] = WORKS[name].result(out)
        return results[name]

    return result_of


@contextmanager
def full_disk(good_writes: int) -> Iterator[None]:
    """After some more writes, every other one finds the disk full."""
    real, left = os.fsync, iter(range(good_writes))

    def fsync(file: int) -> None:
        if next(left, None) is None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(file)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", fsync)
        yield


def serial(arguments: Sequence[str]) -> list[str]:
    """The same command, all its writes in this process."""
    return ["1" if before == "--workers" else word for before, word in zip(["", *arguments], arguments, strict=False)]


@pytest.mark.parametrize(
    ("name", "good_writes"),
    [
        ("assets-process", 0),
        ("assets-process", 3),
        ("generate", 11),
        ("evaluate", 1),
        ("evaluate", 9),
        ("evaluate", 12),
        *(pytest.param("assets-process", count, marks=pytest.mark.slow) for count in (1, 2, 4, 5, 6)),
        *(pytest.param("generate", count, marks=pytest.mark.slow) for count in (0, 1, 2, 3, 4, 8, 10, 12)),
        *(pytest.param("evaluate", count, marks=pytest.mark.slow) for count in (0, 2, 3, 5, 8, 10, 11, 13)),
    ],
)
def test_a_full_disk_is_one_line_and_the_next_run_ends_the_work(name, good_writes, workspace, finished) -> None:
    wanted, out, work = finished(name), workspace.path / "out", WORKS[name]
    arguments = serial(work.command(workspace, out))
    before = fingerprint(workspace.path)
    with full_disk(good_writes):
        check_refusal(run_command(arguments), 1, ("cannot write", str(out), FULL))
    assert before.items() <= fingerprint(workspace.path).items()
    assert not list(out.rglob("*.partial"))
    assert run_command(arguments).code == 0
    assert work.result(out) == wanted


def small_files_only() -> None:
    """In a child, before it starts: the kernel refuses to let a file grow beyond 4 KiB."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))


def render(work: Workspace, out: Path) -> Sequence[str]:
    return ["render", str(work.scenes), "--out", str(out), "--backend", "raycast", "--limit", "1"]


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(generate, id="generate"),
        pytest.param(process, id="assets-process", marks=pytest.mark.slow),
        pytest.param(evaluate, id="evaluate", marks=pytest.mark.slow),
        pytest.param(render, id="render", marks=pytest.mark.slow),
    ],
)
def test_a_file_that_the_kernel_refuses_is_one_line(command, workspace) -> None:
    arguments = command(workspace, workspace.path / "out")
    before = fingerprint(workspace.path)
    outcome = run_process(arguments, preexec_fn=small_files_only)
    check_refusal(outcome, 1, ("cannot write", workspace.out, "File too large; nothing earlier was changed"))
    assert before.items() <= fingerprint(workspace.path).items()


def hear_interrupts() -> None:
    """In a child, before it starts: jobs in the background of a shell are started deaf."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def start(arguments: Sequence[str]) -> subprocess.Popen[str]:
    """The command in a process group of its own, as a terminal would start it."""
    return subprocess.Popen(
        [*COMMAND, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=hear_interrupts,
    )


def wait_for(out: Path, pattern: str, process: subprocess.Popen[str]) -> None:
    """Until the first piece of the work is done."""
    deadline = time.monotonic() + 60
    while not any(out.glob(pattern)):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.parametrize("name", ["generate", "evaluate", pytest.param("assets-process", marks=pytest.mark.slow)])
def test_a_killed_run_is_continued_to_the_same_result(name, workspace, finished) -> None:
    wanted, out, work = finished(name), workspace.path / "out", WORKS[name]
    arguments = work.command(workspace, out)
    with start(arguments) as process:
        wait_for(out, work.progress, process)
        process.kill()
    assert process.returncode == -signal.SIGKILL
    kept = set(out.glob(work.progress))
    assert run_command(serial(arguments)).code == 0
    assert kept <= set(out.glob(work.progress))
    assert work.result(out) == wanted


@pytest.mark.parametrize(
    "name",
    [
        "generate",
        pytest.param("assets-process", marks=pytest.mark.slow),
        pytest.param("evaluate", marks=pytest.mark.slow),
    ],
)
def test_an_interrupted_run_says_so_in_one_line_and_is_continued(name, workspace, finished) -> None:
    wanted, out, work = finished(name), workspace.path / "out", WORKS[name]
    arguments = work.command(workspace, out)
    with start(arguments) as process:
        wait_for(out, work.progress, process)
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (130, "interrupted; what was finished is kept\n")
    assert run_command(serial(arguments)).code == 0
    assert work.result(out) == wanted
