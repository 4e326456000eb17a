"""The root command: fast help, lazy commands, one line for every error."""

import errno
import subprocess
import sys
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

import pytest

from clutter6d import __version__, cli

COMMANDS = """
import errno
import typer
from clutter6d.errors import MeshRejectedError, StorageError, UnknownNameError

app = typer.Typer()


@app.command()
def succeed(times: int = 1) -> None:
    print("done " * times)


@app.command()
def leave(code: int) -> None:
    raise typer.Exit(code)


def unknown_track() -> None:
    raise UnknownNameError("track", "dens", ["sparse", "moderate", "dense"])


def full_disk() -> None:
    raise OSError(errno.ENOSPC, "No space left on device", "out/scene.json")


def storage() -> None:
    raise StorageError("cannot write out/scene.json: No space left on device; nothing earlier was changed")


def interrupted() -> None:
    raise KeyboardInterrupt


def rejected() -> None:
    raise MeshRejectedError("empty", "the mesh has\\nno faces")


def exhausted() -> None:
    raise MemoryError


def broken() -> None:
    raise RuntimeError("a bug of our own")
"""


@pytest.fixture
def _sample_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sample_commands.py").write_text(COMMANDS)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "sample_commands", raising=False)
    monkeypatch.delenv(cli.DEBUG_VARIABLE, raising=False)
    functions = ("unknown_track", "full_disk", "storage", "interrupted", "rejected", "exhausted", "broken")
    entries = [EntryPoint(name.replace("_", "-"), f"sample_commands:{name}", cli.COMMAND_GROUP) for name in functions]
    entries.append(EntryPoint("group", "sample_commands:app", cli.COMMAND_GROUP))
    entries.append(EntryPoint("absent", "no_such_module:app", cli.COMMAND_GROUP))
    monkeypatch.setattr(cli, "entry_points", lambda *, group: entries)


pytestmark = pytest.mark.usefixtures("_sample_commands")


def test_root_help_lists_the_commands_without_importing_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["--help"]) == 0
    shown = capsys.readouterr().out
    assert "unknown-track" in shown
    assert "absent" in shown
    assert "sample_commands" not in sys.modules


def test_root_help_imports_no_heavy_library() -> None:
    script = (
        "import sys; from clutter6d.cli import run; assert run(['--help']) == 0;"
        "heavy = {'mujoco', 'trimesh', 'torch', 'pandas', 'scipy', 'numpy', 'coacd', 'pxr'} & set(sys.modules);"
        "sys.exit(f'imported {heavy}' if heavy else 0)"
    )
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert result.returncode == 0, result.stderr


def test_every_summary_belongs_to_an_installed_command() -> None:
    installed = {entry.name for entry in entry_points(group=cli.COMMAND_GROUP)}
    assert set(cli.SUMMARIES) <= installed


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["--version"]) == 0
    assert capsys.readouterr().out == f"clutter6d {__version__}\n"


def test_a_command_runs_with_its_options(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["group", "succeed", "--times", "2"]) == 0
    assert capsys.readouterr().out == "done done \n"


def test_a_command_may_choose_its_exit_code() -> None:
    assert cli.run(["group", "leave", "7"]) == 7


@pytest.mark.parametrize(
    ("arguments", "code", "line"),
    [
        (["unknown-track"], 2, "error: unknown track 'dens'; did you mean 'dense'? (known: dense, moderate, sparse)"),
        (["full-disk"], 1, "error: out/scene.json: No space left on device; nothing earlier was changed"),
        (["storage"], 1, "error: cannot write out/scene.json: No space left on device; nothing earlier was changed"),
        (["interrupted"], 130, "interrupted; what was finished is kept"),
        (["rejected"], 1, "error: empty: the mesh has no faces"),
        (["exhausted"], 1, "error: out of memory; try fewer workers or parallel environments"),
        (["group", "succeed", "--times", "many"], 2, None),
        (["group", "succeed", "--speed", "2"], 2, "error: No such option: --speed"),
        (["group", "leave"], 2, "error: Missing argument 'code'."),
        (["brokn"], 2, "error: No such command 'brokn'. Did you mean 'broken'?"),
    ],
)
def test_an_error_is_one_line_on_stderr(
    arguments: list[str], code: int, line: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(arguments) == code
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert line is None or captured.err == f"{line}\n"


def test_debugging_shows_where_an_error_came_from(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cli.DEBUG_VARIABLE, "1")
    with pytest.raises(OSError, match="No space") as caught:
        cli.run(["full-disk"])
    assert caught.value.errno == errno.ENOSPC


def test_a_bug_of_our_own_is_not_dressed_up_as_a_users_error() -> None:
    with pytest.raises(RuntimeError, match="a bug of our own"):
        cli.run(["broken"])


def test_no_arguments_show_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run([]) == 2
    captured = capsys.readouterr()
    assert "Usage: clutter6d" in captured.out + captured.err
    assert "error" not in captured.err
