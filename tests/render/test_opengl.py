"""A renderer that is interrupted while it is made."""

import subprocess
import sys

import pytest

from clutter6d.render.backend import choose_backend

INTERRUPTED_WHILE_MADE = """
import sys

import mujoco

from clutter6d.render.opengl import OpenGlRenderer


def interrupt(*_, **__):
    raise KeyboardInterrupt


setattr(mujoco, sys.argv[2], interrupt)
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='0.1'/></worldbody></mujoco>")
try:
    OpenGlRenderer(model, 64, 48, sys.argv[1], (0,))
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.parametrize("stage", ["MjrContext", "MjvScene"])
def test_interrupted_while_it_is_made_the_program_ends_quietly(stage: str) -> None:
    backend = choose_backend()
    if backend == "raycast":
        pytest.skip("no OpenGL here")
    command = [sys.executable, "-c", INTERRUPTED_WHILE_MADE, backend, stage]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "interrupted\n", "")
