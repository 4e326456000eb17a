"""The documentation says what is true: its commands and options exist, and its example policy works."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from clutter6d import cli
from clutter6d.eval.policy import PolicyInput, PolicyOptions
from dapl_baselines.cli import PROGRAM as DAPL

ROOT = Path(__file__).resolve().parent.parent
PROGRAMS = {"clutter6d": cli.CLUTTER6D, "dapl": DAPL}
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)


def commands() -> list[str]:
    lines = (
        line for page in PAGES for block in blocks(page, "bash") for line in block.replace("\\\n", "").splitlines()
    )
    return sorted({line for line in lines if line.startswith(tuple(f"{name} " for name in PROGRAMS))})


def targets() -> list[str]:
    lines = (line for page in PAGES for block in blocks(page, "bash") for line in block.splitlines())
    return sorted({line.split()[1] for line in lines if line.startswith("make ")})


@pytest.mark.parametrize("line", commands())
def test_every_command_and_option_exists(line: str) -> None:
    program, *words = shlex.split(line, comments=True)
    command = cli.build_command(PROGRAMS[program])
    while words and words[0] in getattr(command, "commands", {}):
        command = command.commands[words.pop(0)]
        command = command.load() if hasattr(command, "load") else command
    known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
    assert {word.split("=")[0] for word in words if word.startswith("-")} <= known | {"--help"}


@pytest.mark.parametrize("target", targets())
def test_every_make_target_exists(target: str) -> None:
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE)


def test_the_example_policy_works() -> None:
    (example,) = blocks(ROOT / "docs" / "evaluate.md", "python")
    names: dict[str, object] = {}
    exec(compile(example, "docs/evaluate.md", "exec"), names)
    policy = names["make"](PolicyOptions())  # type: ignore[operator]
    inputs = PolicyInput(slots=np.arange(3), episodes=(), steps=np.arange(3), observation=None, states=None)
    policy.begin(inputs.slots, ())
    actions = policy.act(inputs)
    assert (actions.shape, actions.dtype) == ((3, 7), np.float32)
    assert len(policy.policy_hash) == 64


def test_the_examples_of_the_environments_page_run() -> None:
    names: dict[str, object] = {}
    for example in blocks(ROOT / "docs" / "environments.md", "python")[:2]:
        exec(compile(example, "docs/environments.md", "exec"), names)
    assert names["observations"]["object_points"].shape == (64, 512, 7)  # type: ignore[index]
