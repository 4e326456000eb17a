"""The page "Deploy on a robot" says what is true: its commands and options exist, and its examples run."""

import re
import shlex
from pathlib import Path

import pytest

from clutter6d.cli import build_command
from clutter6d.envs.observation import OBSERVATION_SHAPES
from clutter6d.eval.policy import PolicyOptions
from dapl_baselines.cli import PROGRAM
from tests.dapl_baselines.serving.conftest import DAPL
from tests.dapl_baselines.serving.running_server import running

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "deploy.md").read_text()


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


COMMANDS = [line for block in blocks("bash") for line in block.splitlines() if line.startswith("dapl ")]


@pytest.mark.parametrize("line", COMMANDS)
def test_every_command_and_option_exists(line):
    words = shlex.split(line)[1:]
    command = build_command(PROGRAM).commands[words.pop(0)].load()
    known = {option for parameter in command.params for option in parameter.opts}
    assert {word for word in words if word.startswith("--")} <= known


def test_the_examples_run(checkpoints, tmp_path, monkeypatch, capsys):
    observe, wrap, serve = blocks("python")
    names = {}
    exec(compile(observe, "deploy.md", "exec"), names)
    assert {name: value.shape for name, value in names["observation"].items()} == OBSERVATION_SHAPES
    exec(compile(wrap, "deploy.md", "exec"), names)
    (tmp_path / "policy.pt").write_bytes(checkpoints["state"].read_bytes())
    monkeypatch.chdir(tmp_path)
    assert names["make"](PolicyOptions()).name == "state-policy-from-poses"
    with running(*DAPL, "serve", "zero") as server:
        exec(compile(serve.replace("8000", str(server.port)), "deploy.md", "exec"), names)
    assert not names["residuals"].any()
