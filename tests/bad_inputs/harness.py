"""Running a command as a user would, and looking at what it said and what it touched."""

import contextlib
import hashlib
import io
import os
import stat
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from clutter6d.cli import run

COMMAND = (sys.executable, "-c", "from clutter6d.cli import main; main()")
"""The command line in a process of its own."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Outcome:
    """How a command ended."""

    code: int
    out: str
    err: str


@dataclass(frozen=True, kw_only=True, slots=True)
class Workspace:
    """Good things on disk, to be spoiled by one case.

    Attributes:
        path: The folder that holds all of them.
        library: An asset library of boxes.
        scenes: A set of two scenes of boxes with two goal pairs each.
        results: A finished evaluation of ``zero`` on them.
    """

    path: Path
    library: Path
    scenes: Path
    results: Path

    @property
    def out(self) -> str:
        """A folder that is not there yet."""
        return str(self.path / "out")


@dataclass(frozen=True, kw_only=True, slots=True)
class Case:
    """One mistake.

    Attributes:
        name: What is wrong, as the test's id.
        make: Makes the mistake and returns the command that meets it.
        says: What the error line must contain, among it where the mistake is.
        code: The exit code: 2 for a user's mistake, 1 for a fault of the machine.
    """

    name: str
    make: Callable[[Workspace], Sequence[str]]
    says: tuple[str, ...]
    code: int = 2


def run_command(arguments: Sequence[str]) -> Outcome:
    """Run the command line in this process; an exception that it lets through fails the test."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run(list(arguments))
    return Outcome(code=code, out=out.getvalue(), err=err.getvalue())


def run_process(arguments: Sequence[str], **options) -> Outcome:
    """Run the command line in a process of its own."""
    done = subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, timeout=120, check=False, **options)
    return Outcome(code=done.returncode, out=done.stdout, err=done.stderr)


def check_refusal(outcome: Outcome, code: int, says: Sequence[str]) -> None:
    """One error line, the right exit code, no traceback."""
    lines = outcome.err.splitlines()
    assert (outcome.code, len(lines)) == (code, 1), f"exit code {outcome.code}: {outcome.err or outcome.out}"
    assert lines[0].startswith("error: ")
    assert "Traceback" not in outcome.out + outcome.err
    for words in says:
        assert words in lines[0], f"{words!r} is not in: {lines[0]}"


def fingerprint(folder: Path) -> dict[str, str]:
    """What a folder holds: every path below it, with the hash of its content."""
    found: dict[str, str] = {}
    for parent, _, names in os.walk(folder):
        for path in (Path(parent), *(Path(parent, name) for name in names)):
            mode = path.lstat().st_mode
            if stat.S_ISREG(mode):
                is_small = path.stat().st_size < 100 << 20
                content = hashlib.sha256(path.read_bytes()).hexdigest() if is_small else str(path.stat().st_mtime_ns)
            else:
                content = oct(stat.S_IFMT(mode))
            found[str(path.relative_to(folder))] = content
    return found
