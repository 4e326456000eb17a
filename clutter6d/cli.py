"""The command ``clutter6d``: its commands come from entry points and are imported only when they are used.

A package adds a command by an entry point in the group ``clutter6d.commands`` that names a typer app or a function.
Errors of this project, and those of the operating system, end in one line on stderr and the error's exit code. Other
programs of this project (``dapl``) are a :class:`Program` of their own and share everything else.
"""

import logging
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from clutter6d import __version__
from clutter6d.errors import Clutter6DError

COMMAND_GROUP = "clutter6d.commands"
DEBUG_VARIABLE = "CLUTTER6D_DEBUG"
INTERRUPTED = 130

SUMMARIES = {
    "assets": "Make assets from meshes; annotate, review, list and verify them.",
    "generate": "Generate certified scenes of a track.",
    "estimate": "Plan a large run: hours, cores, bytes.",
    "dataset": "Look at, check, make and compare frozen data sets.",
    "evaluate": "Run a policy on scenes and write its table.",
    "play": "Watch a policy act, in the browser or MuJoCo's viewer.",
    "record": "Record episodes as videos, Parquet tables or LeRobot data sets.",
    "replay": "Re-simulate an evaluation and compare it to the bit.",
    "teleop": "Drive the robot by hand, and be evaluated like a policy.",
    "render": "Draw stills, contact sheets and videos.",
    "view": "Open a scene in MuJoCo's viewer.",
    "export": "Write scenes as MJCF, USD, USDZ or GLB.",
}
"""What the root help says of the built-in commands, so that it need not import them; in the order of a user's work."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Program:
    """A console script.

    Attributes:
        name: Its name.
        summary: One line on what it is for.
        summaries: What the root help says of its commands, in the order in which it lists them.
        find_commands: Its commands; a name of two words is a command of a group named by the first.
        group_summaries: What the help says of such groups.
    """

    name: str
    summary: str
    summaries: Mapping[str, str]
    find_commands: Callable[[], Sequence[EntryPoint]]
    group_summaries: Mapping[str, str]


CLUTTER6D = Program(
    name="clutter6d",
    summary="Scenes, simulation and evaluation for 6-D object rearrangement in clutter.",
    summaries=SUMMARIES,
    find_commands=lambda: tuple(entry_points(group=COMMAND_GROUP)),
    group_summaries={},
)


class LazyCommand(TyperCommand):
    """Stands for a command in the root help and becomes it when it is called."""

    def __init__(self, entry: EntryPoint, summary: str) -> None:
        super().__init__(name=entry.name.split()[-1], help=summary)
        self._entry = entry

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Let the imported command read its arguments."""
        return self.load().make_context(info_name, args, parent, **extra)

    def load(self) -> TyperCommand | TyperGroup:
        """Import the command itself: an app, or a function that becomes one."""
        app = loaded = self._entry.load()
        if not isinstance(loaded, typer.Typer):
            app = typer.Typer(add_completion=False)
            app.command(self.name)(loaded)
        command: Any = typer.main.get_command(app)
        command.name = self.name
        return command


def _summary(program: Program, entry: EntryPoint) -> str:
    return program.summaries.get(entry.name) or f"Provided by {entry.dist.name if entry.dist else entry.module}."


def _show_version(is_wanted: bool) -> bool:
    if is_wanted:
        print(f"clutter6d {__version__}")
        raise typer.Exit
    return is_wanted


def _root(
    debug: Annotated[bool, typer.Option("--debug", help="Show log messages, and tracebacks of errors.")] = False,
    _version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    if debug:
        os.environ[DEBUG_VARIABLE] = "1"
    level = logging.DEBUG if _is_debugging() else logging.WARNING
    logging.basicConfig(level=level, format="%(levelname)s: %(message)s")


def _is_debugging() -> bool:
    return os.environ.get(DEBUG_VARIABLE, "") not in ("", "0")


def build_command(program: Program = CLUTTER6D) -> TyperGroup:
    """The root command with every command that is installed."""
    app = typer.Typer(name=program.name, no_args_is_help=True)
    app.callback(help=program.summary)(_root)
    for name, summary in program.group_summaries.items():
        branch = typer.Typer(no_args_is_help=True)
        branch.callback(help=summary)(_no_options)
        app.add_typer(branch, name=name)
    root: Any = typer.main.get_command(app)
    rank = {name: index for index, name in enumerate(program.summaries)}
    for entry in sorted(program.find_commands(), key=lambda entry: (rank.get(entry.name, len(rank)), entry.name)):
        *path, name = entry.name.split()
        parent = root.commands[path[0]] if path else root
        parent.add_command(LazyCommand(entry, _summary(program, entry)), name)
    return root


def _no_options() -> None:
    pass


def run(arguments: Sequence[str], program: Program = CLUTTER6D) -> int:
    """Run the command line and return its exit code; every expected error becomes one line on stderr."""
    try:
        result = build_command(program).main(list(arguments), prog_name=program.name, standalone_mode=False)
    except typer.TyperException as error:
        return _fail(error, error.format_message(), error.exit_code)
    except typer.Abort as error:
        return _fail(error, "stopped at a question", 1)
    except Clutter6DError as error:
        return _fail(error, str(error), error.exit_code)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _fail(error, f"{where}{error.strerror or error}; nothing earlier was changed", 1)
    except MemoryError as error:
        return _fail(error, "out of memory; try fewer workers or parallel environments", 1)
    code = result if isinstance(result, int) else 0
    if code == INTERRUPTED:
        print("interrupted; what was finished is kept", file=sys.stderr)
    return code


def _fail(error: BaseException, message: str, code: int) -> int:
    if _is_debugging() and not isinstance(error, typer.TyperException):
        raise error
    line = " ".join(message.split())
    if line:
        print(f"error: {line}", file=sys.stderr)
    return code


def main() -> None:
    """Entry point of the console script."""
    sys.exit(run(sys.argv[1:]))
