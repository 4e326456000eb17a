"""The command ``clutter6d teleop``: a person attempts a sample of scenes, and is evaluated like any policy."""

import shutil
import sys
from contextlib import closing, nullcontext
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from clutter6d.envs.termination import MAX_CONTROL_STEPS
from clutter6d.errors import InvalidValueError
from clutter6d.eval.cli import default_folder, open_all_scenes, print_report, remember_scenes
from clutter6d.eval.episode import EpisodeRow
from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.eval.sample import PAPER_SAMPLE
from clutter6d.play.live_view import LiveView
from clutter6d.play.open_view import open_view
from clutter6d.play.web_view import WebView
from clutter6d.progress import progress_bars
from clutter6d.schema import write_model
from dapl_baselines.teleop.calibration import read_calibration
from dapl_baselines.teleop.device import TeleopDevice
from dapl_baselines.teleop.devices import make_device, needed_port
from dapl_baselines.teleop.operator import OperatorLeftError, offered_actions
from dapl_baselines.teleop.policy import TeleopPolicy
from dapl_baselines.teleop.status import KEY_LINES, Status, to_line
from dapl_baselines.teleop.terminal import Terminal


def teleop(
    device: Annotated[str, typer.Option(help="keyboard, gamepad, spacemouse or gello.")] = "keyboard",
    scenes: Annotated[
        str, typer.Option(help="A frozen split, such as dense-test, or a folder made by clutter6d generate.")
    ] = "sparse-test",
    port: Annotated[Path | None, typer.Option(help="Device file: /dev/ttyUSB0 of a GELLO, /dev/hidraw0.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the results, by default evaluations/teleop-DEVICE-SCENES; one that was left goes on."
        ),
    ] = None,
    operator: Annotated[str, typer.Option(help="Who drives: letters, digits and hyphens, added to the name.")] = "",
    sample: Annotated[
        int | None, typer.Option(min=1, help="Scenes drawn at random, the same for everyone; default 10, as the paper.")
    ] = None,
    pairs: Annotated[int, typer.Option(min=1, help="Goal pairs of each scene, the first; the paper has 1.")] = 1,
    viewer: Annotated[str, typer.Option(help="web, native, auto or none.")] = "auto",
    max_steps: Annotated[
        int, typer.Option(min=1, help="Steps of an attempt at most; other than 300 is not official.")
    ] = MAX_CONTROL_STEPS,
    calibration: Annotated[Path, typer.Option(help="The GELLO's calibration.")] = Path("gello-calibration.json"),
    calibrate: Annotated[
        bool, typer.Option("--calibrate", help="Read a GELLO that is held in the square pose, write that, and end.")
    ] = False,
) -> None:
    """Drive the robot by hand, in real time; attempts are recorded and evaluated like any policy's."""
    if calibrate:
        _calibrate(device, needed_port(port), calibration)
        return
    if not all(letter.isalnum() or letter == "-" for letter in operator):
        raise InvalidValueError(f"operator '{operator}': only letters, digits and hyphens")
    held, collection = make_device(device, port, calibration), open_all_scenes(scenes)
    sample = sample or min(PAPER_SAMPLE, len(collection.scenes))
    out = out or default_folder("-".join(filter(None, ["teleop", device, operator])), scenes, sample)
    config = EvaluationConfig(pairs=pairs, sample=sample, max_steps=max_steps)
    with Terminal() as terminal, closing(held):
        if device in ("keyboard", "gello") and not terminal.is_terminal and viewer == "none":
            raise InvalidValueError(f"with a {device} and no viewer, keys are needed: start it in a terminal")
        held.connect()
        view = None if viewer == "none" else open_view(viewer)
        with closing(view) if view is not None else nullcontext():
            line = StatusLine()
            policy = TeleopPolicy(
                held, out, keys=terminal, view=view, show=line.show, operator=operator, max_steps=max_steps
            )
            evaluation = Evaluation(collection, policy, out, config)
            remember_scenes(out, scenes)
            _introduce(held, view, line)
            is_done = _attempt_all(evaluation, policy, line)
    if is_done:
        _finish(evaluation, out)


class StatusLine:
    """The terminal's last line, written over and over; attempts and notes are lines that stay, in a file phases too."""

    def __init__(self) -> None:
        self._is_terminal, self._last = sys.stdout.isatty(), (0, "", "")

    def show(self, status: Status) -> None:
        """Show how things stand."""
        last, self._last = self._last, (status.number, status.phase, status.note)
        if status.number != last[0]:
            self.say(f"attempt {status.number} of {status.total}: {status.scene_id} pair {status.pair}")
        if status.note and status.note != last[2]:
            self.say(f"* {status.note}")
        if self._is_terminal:
            print(f"\r\x1b[K{to_line(status)[: shutil.get_terminal_size().columns - 1]}", end="", flush=True)
        elif status.phase != last[1]:
            print(to_line(status), flush=True)

    def say(self, text: str) -> None:
        """A line that stays."""
        print(f"\r\x1b[K{text}" if self._is_terminal else text, flush=True)


def _introduce(held: TeleopDevice, view: LiveView | None, line: StatusLine) -> None:
    for text in (*held.help_lines, *KEY_LINES):
        control, _, effect = text.partition("\t")
        line.say(f"  {control:18} {effect}")
    if view is not None:
        view.offer(offered_actions(held))
    if isinstance(view, WebView):
        line.say(f"  the scene          {view.url}")


def _attempt_all(evaluation: Evaluation, policy: TeleopPolicy, line: StatusLine) -> bool:
    """Let the person make the attempts that are left; returns whether all are made."""
    policy.attempt, policy.attempts = len(evaluation.finished()), len(evaluation.keys)
    try:
        for row in evaluation.run("journal", num_envs=1, threads=1):
            policy.forget(*row.key)
            line.say(_describe(row))
    except OperatorLeftError:
        done = len(evaluation.finished())
        line.say(f"{done} of {policy.attempts} attempts are made; the same command goes on")
        return False
    return True


def _describe(row: EpisodeRow) -> str:
    errors = f"{100 * row.position_error_m:.1f} cm and {np.rad2deg(row.rotation_error_rad):.0f}° from the goal"
    return f"{row.scene_id} pair {row.pair}: {row.outcome} after {row.steps} steps, {errors}"


def _finish(evaluation: Evaluation, out: Path) -> None:
    """The floor, and the table."""
    console = Console(markup=False, emoji=False)
    with progress_bars(console) as progress:
        done = len(evaluation.finished("floor"))
        bar = progress.add_task("zero action (floor)", total=len(evaluation.keys), completed=done)
        for _ in evaluation.run("floor"):
            progress.advance(bar)
    print_report(evaluation.finish(), out, console)


def _calibrate(device: str, port: Path, path: Path) -> None:
    if device != "gello":
        raise InvalidValueError(f"a {device} needs no calibration; leave out --calibrate")
    write_model(path, read_calibration(port))
    print(f"written to {path}")
