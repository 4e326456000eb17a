"""The command ``dapl``: its table of commands, and a root help that does not wait for PyTorch."""

import subprocess
import sys

import pytest

from clutter6d.cli import run
from dapl_baselines.cli import PROGRAM

COMMANDS = [entry.name for entry in PROGRAM.find_commands()]
ROOT_HELP = """
import sys
from clutter6d.cli import run
from dapl_baselines.cli import PROGRAM
code = run(["--help"], PROGRAM) or run(["train", "--help"], PROGRAM)
heavy = {"torch", "mujoco", "numba", "onnxruntime"} & set(sys.modules)
sys.exit(f"imports {heavy}" if heavy else code)
"""


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_found_and_tells_its_options(name, capsys):
    assert run([*name.split(), "--help"], PROGRAM) == 0
    said = capsys.readouterr().out
    assert f"dapl {name}" in said
    assert "--help" in said


def test_the_root_help_lists_all_commands_and_imports_none():
    shown = subprocess.run([sys.executable, "-c", ROOT_HELP], capture_output=True, text=True, check=False)
    assert shown.returncode == 0, shown.stderr
    assert all(name.split()[-1] in shown.stdout for name in COMMANDS)


def test_every_command_has_a_summary():
    assert set(PROGRAM.summaries) == set(COMMANDS)
    assert all(summary.endswith(".") for summary in PROGRAM.summaries.values())
