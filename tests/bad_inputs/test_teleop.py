"""Teleoperation without a device, with the wrong one, or with files that are none."""

import json
from collections.abc import Sequence

import pytest

from clutter6d.schema import write_model
from dapl_baselines.teleop.gello import GelloCalibration
from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command


def teleop(work: Workspace, device: str, *more: str, **changed: str) -> list[str]:
    options = {"scenes": str(work.scenes), "out": work.out, "viewer": "none", "max-steps": "3"} | changed
    words = (word for name, value in options.items() for word in (f"--{name}", value))
    return ["teleop", "--device", device, *words, *more]


def gello(work: Workspace, **changed: str) -> list[str]:
    options = {"port": str(work.path / "ttyUSB9"), "calibration": str(work.path / "gello.json")} | changed
    return teleop(work, "gello", **options)


def damaged_calibration(**changed: object):
    def make(work: Workspace) -> Sequence[str]:
        path = work.path / "gello.json"
        write_model(path, GelloCalibration(offsets_rad=(0.0,) * 7))
        path.write_text(json.dumps({**json.loads(path.read_text()), **changed}))
        return gello(work)

    return make


def no_json(work: Workspace) -> Sequence[str]:
    (work.path / "gello.json").write_text("offsets: none")
    return gello(work)


def no_such_port(work: Workspace) -> Sequence[str]:
    write_model(work.path / "gello.json", GelloCalibration(offsets_rad=(0.0,) * 7))
    return gello(work, viewer="web")


CASES = [
    Case(
        name="unknown-device",
        make=lambda work: teleop(work, "gamepda"),
        says=("unknown device 'gamepda'", "did you mean 'gamepad'?", "spacemouse"),
    ),
    Case(
        name="keyboard-without-a-terminal",
        make=lambda work: teleop(work, "keyboard"),
        says=("with a keyboard and no viewer", "start it in a terminal"),
    ),
    Case(
        name="keyboard-with-a-port",
        make=lambda work: teleop(work, "keyboard", port="/dev/ttyUSB0"),
        says=("a keyboard has no port", "leave out --port"),
    ),
    Case(name="no-gamepad", make=lambda work: teleop(work, "gamepad"), says=("no gamepad is plugged in",)),
    Case(name="no-spacemouse", make=lambda work: teleop(work, "spacemouse"), says=("no SpaceMouse", "--port")),
    Case(
        name="spacemouse-port-not-there",
        make=lambda work: teleop(work, "spacemouse", port=str(work.path / "hidraw9")),
        says=("hidraw9", "No such file"),
    ),
    Case(
        name="gello-without-a-port",
        make=lambda work: teleop(work, "gello"),
        says=("a GELLO needs its serial port", "--port /dev/ttyUSB0"),
    ),
    Case(
        name="gello-not-calibrated",
        make=gello,
        says=("GELLO calibration not found", "gello.json", "--calibrate"),
    ),
    Case(name="gello-port-not-there", make=no_such_port, says=("serial port", "ttyUSB9")),
    Case(name="calibration-no-json", make=no_json, says=("gello.json", "not a valid GELLO calibration")),
    Case(
        name="calibration-sign-of-two",
        make=damaged_calibration(signs=[1, 1, 1, 1, 1, 1, 2]),
        says=("gello.json", "signs.6"),
    ),
    Case(
        name="calibration-of-six-joints",
        make=damaged_calibration(offsets_rad=[0.0] * 6),
        says=("gello.json", "offsets_rad"),
    ),
    Case(
        name="calibration-motor-of-no-id",
        make=damaged_calibration(motor_ids=[1, 2, 3, 4, 5, 6, 300]),
        says=("gello.json", "motor_ids.6"),
    ),
    Case(
        name="calibration-motor-twice",
        make=damaged_calibration(motor_ids=[1, 2, 3, 4, 5, 6, 6]),
        says=("gello.json", "motor_ids", "6 twice"),
    ),
    Case(
        name="calibration-of-a-keyboard",
        make=lambda work: teleop(work, "keyboard", "--calibrate", port="/dev/ttyUSB0"),
        says=("a keyboard needs no calibration",),
    ),
    Case(
        name="calibration-without-a-port",
        make=lambda work: teleop(work, "gello", "--calibrate"),
        says=("a GELLO needs its serial port",),
    ),
    Case(
        name="operator-with-a-slash",
        make=lambda work: teleop(work, "keyboard", operator="../me"),
        says=("operator '../me'", "letters, digits and hyphens"),
    ),
    Case(
        name="unknown-viewer",
        make=lambda work: teleop(work, "keyboard", viewer="vr"),
        says=("unknown viewer 'vr'", "web"),
    ),
    Case(
        name="sample-larger-than-the-set",
        make=lambda work: teleop(work, "keyboard", sample="3", viewer="web"),
        says=("sample is 3", "2 scenes"),
    ),
    Case(
        name="evaluate-a-sample-larger-than-the-set",
        make=lambda work: [
            "evaluate", "--policy", "zero", "--scenes", str(work.scenes), "--out", work.out, "--sample", "3",
        ],
        says=("sample is 3", "choose 1 to 2"),
    ),
    Case(
        name="scenes-that-are-not-there",
        make=lambda work: teleop(work, "keyboard", scenes=str(work.path / "nowhere")),
        says=("scene set not found", "nowhere"),
    ),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_mistake_is_one_line_and_nothing_is_written(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert fingerprint(workspace.path) == before


@pytest.mark.parametrize(("module", "device"), [("dynamixel_sdk", "gello"), ("pygame", "gamepad")])
def test_a_missing_package_is_named(workspace: Workspace, monkeypatch, module, device) -> None:
    monkeypatch.setitem(__import__("sys").modules, module, None)
    write_model(workspace.path / "gello.json", GelloCalibration(offsets_rad=(0.0,) * 7))
    arguments = gello(workspace, viewer="web") if device == "gello" else teleop(workspace, device)
    check_refusal(run_command(arguments), 2, ('pip install "clutter6d[teleop]"',))
