"""``clutter6d teleop`` in a process and a terminal of its own, typed into as a person would."""

import json
import os
import pty
import re
import select
import signal
import subprocess
import time

import numpy as np
import pytest

from clutter6d.cli import run
from clutter6d.schema import read_model
from clutter6d.sim.robot import HOME_QPOS
from dapl_baselines.teleop.gello import JOINT_SIGNS, SQUARE_POSE_RAD, GelloCalibration
from tests.bad_inputs.harness import COMMAND
from tests.dapl_baselines.teleop.simulated_bus import SimulatedBus
from tests.scene_fixtures import write_box_scene_set

PATIENCE_S = 60.0
OFFSETS = np.array([1, 2, -1, 3, 0, 4, 1]) * np.pi / 2


class TypedInto:
    """The command in a terminal."""

    def __init__(self, *arguments) -> None:
        self._master, slave = pty.openpty()
        command = [*COMMAND, "teleop", *(str(argument) for argument in arguments)]
        self.process = subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave)
        os.close(slave)
        self.shown = ""

    def __enter__(self) -> "TypedInto":
        return self

    def __exit__(self, *error) -> None:
        self.process.kill()
        self.process.wait()
        os.close(self._master)

    def press(self, keys: str) -> None:
        os.write(self._master, keys.encode())

    def wait_for(self, pattern: str, hold: str = "") -> str:
        """Read on until something is shown, holding keys down meanwhile; returns what was shown until then."""
        until = time.monotonic() + PATIENCE_S
        while not (found := re.search(pattern, self.shown)):
            assert self._read(), f"ended before {pattern!r}: {self.shown[-2000:]}"
            assert time.monotonic() < until, f"{pattern!r} did not come: {self.shown[-2000:]}"
            if hold:
                self.press(hold)
        before, self.shown = self.shown[: found.end()], self.shown[found.end() :]
        return before

    def end(self) -> int:
        """Read to the end; returns the exit code."""
        until = time.monotonic() + PATIENCE_S
        while self._read():
            assert time.monotonic() < until, f"did not end: {self.shown[-2000:]}"
        return self.process.wait(PATIENCE_S)

    def _read(self) -> bool:
        if not select.select([self._master], [], [], 0.03)[0]:
            return True
        try:
            self.shown += os.read(self._master, 65536).decode(errors="replace")
        except OSError:
            return False
        return True


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("teleop") / "scenes"
    write_box_scene_set(folder)
    return folder


def options(scenes, out, *more, device="keyboard", steps=8):
    always = ["--device", device, "--scenes", scenes, "--out", out, "--max-steps", steps]
    return [*always, *(more or ["--viewer", "none"])]


def test_a_person_at_the_keyboard_drives_and_is_evaluated(scenes, tmp_path, capsys):
    out = tmp_path / "out"
    with TypedInto(*options(scenes, out), "--operator", "left-hand") as command:
        command.wait_for("away from you")
        for number, scene in enumerate(("boxes-0", "boxes-1"), start=1):
            command.wait_for(f"attempt {number} of 2: {scene} pair 0")
            command.wait_for("READY")
            command.press("\r")
            command.wait_for(f"{scene} pair 0: timeout after 8 steps", hold="3iu")
        assert command.end() == 0
        assert "teleop-keyboard-left-hand" in command.shown
    report = json.loads((out / "report.json").read_text())
    assert (report["policy"], report["episodes"], report["settings"]["sample"]) == ("teleop-keyboard-left-hand", 2, 2)
    assert run(["replay", str(out), "--threads", "1"]) == 0
    assert "2 of 2 episodes identical to the bit" in capsys.readouterr().out


def test_leaving_and_even_a_kill_lose_nothing(scenes, tmp_path):
    out = tmp_path / "out"
    with TypedInto(*options(scenes, out, steps=30)) as command:
        command.wait_for("READY")
        command.press("\r")
        command.wait_for("27 steps left", hold="i")
        command.process.send_signal(signal.SIGKILL)
        assert command.end() == -signal.SIGKILL
    decided = (out / "drafts" / "boxes-0@0000.f32").read_bytes()
    with TypedInto(*options(scenes, out, steps=30)) as command:
        command.wait_for("goes on after step [3-9]")
        command.press("\r")
        command.wait_for("15 steps left", hold="j")
        command.press(" ")
        command.wait_for("PAUSED")
        command.press("x")
        assert command.end() == 0
        assert "0 of 2 attempts are made; the same command goes on" in command.shown
    assert (out / "drafts" / "boxes-0@0000.f32").read_bytes().startswith(decided)


def test_ctrl_c_leaves_as_in_every_other_command(scenes, tmp_path):
    with TypedInto(*options(scenes, tmp_path / "out", steps=30)) as command:
        command.wait_for("READY")
        command.press("\r")
        command.wait_for("27 steps left", hold="i")
        command.process.send_signal(signal.SIGINT)  # what Ctrl-C sends in one's own terminal
        assert command.end() == 130
        assert "interrupted; what was finished is kept" in command.shown
        assert "Traceback" not in command.shown
    assert (tmp_path / "out" / "drafts" / "boxes-0@0000.f32").stat().st_size >= 3 * 28


def test_the_scene_is_shown_in_the_browser(scenes, tmp_path):
    pytest.importorskip("viser")
    with TypedInto(*options(scenes, tmp_path / "out", "--viewer", "web")) as command:
        command.wait_for(r"http://127\.0\.0\.1:\d+")
        command.wait_for("READY")
        command.press("\r")
        command.wait_for("4 steps left", hold="i")
        command.press("x")
        assert command.end() == 0


def test_a_gello_is_calibrated_leads_and_may_be_unplugged(scenes, tmp_path):
    out, calibration = tmp_path / "out", tmp_path / "gello.json"
    with SimulatedBus() as motors:
        motors.set_angles(np.array(JOINT_SIGNS) * (SQUARE_POSE_RAD + 0.1) + OFFSETS)
        where = ["--port", str(motors.port), "--calibration", str(calibration)]
        assert run(["teleop", "--device", "gello", "--calibrate", *where]) == 0
        found = read_model(calibration, GelloCalibration, what="GELLO calibration")
        np.testing.assert_allclose(found.offsets_rad, OFFSETS, atol=1e-9)
        with TypedInto(*options(scenes, out, device="gello", steps=300), *where) as command:
            command.wait_for("READY")
            command.press("\r")
            command.wait_for(r"turn joint \d by [+-]\d+ degrees")
            motors.set_angles(np.array(JOINT_SIGNS) * (HOME_QPOS + 0.2) + OFFSETS)
            command.press("\r")
            command.wait_for("295 steps left")
            motors.unplug()
            command.wait_for(r"\* .*(gone|not answer)")
            command.wait_for("PAUSED")
            command.press("x")
            assert command.end() == 0
    actions = np.frombuffer((out / "drafts" / "boxes-0@0000.f32").read_bytes(), "<f4").reshape(-1, 7)
    np.testing.assert_allclose(actions[0], 0.1, atol=1e-6)
    assert not actions[-1].any()
