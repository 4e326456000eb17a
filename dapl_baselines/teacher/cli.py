"""The command ``dapl train teacher``."""

from pathlib import Path
from typing import Annotated

import typer

from dapl_baselines.bundled import open_checkpoint
from dapl_baselines.preset_choices import find_preset, with_choices
from dapl_baselines.teacher.iteration_report import TeacherReport
from dapl_baselines.teacher.settings import PRESETS
from dapl_baselines.teacher.training import TeacherTraining
from dapl_baselines.training_cli import follow
from dapl_baselines.validation import open_training_scenes
from dapl_baselines.validation_run import Observer


def train_teacher(
    preset: Annotated[str, typer.Option(help=f"{' or '.join(PRESETS)}.")] = "laptop",
    split: Annotated[
        str, typer.Option(help="A frozen training split or a folder of scenes; one scene of 16 is held out.")
    ] = "sparse-train",
    start: Annotated[
        str | None,
        typer.Option(help="The .pt of a teacher to begin with, or push-teacher, which comes along; default: none."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder; a training that was left goes on.")] = Path("trainings/teacher"),
    iterations: Annotated[int | None, typer.Option(min=1, help="Iterations in all; default the preset's.")] = None,
    falling_updates: Annotated[
        int | None,
        typer.Option(min=1, help="Steps in which the learning rate falls; default the preset's. May be changed later."),
    ] = None,
    learning_rate: Annotated[
        float | None,
        typer.Option(
            min=0, max=1, help="The optimiser's, at first; default the preset's. With --start, a smaller one."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything drawn.")] = 0,
    threads: Annotated[int, typer.Option(min=0, help="Threads of the simulation; 0 for all cores.")] = 0,
    max_minutes: Annotated[
        float | None, typer.Option(min=0, help="Stop after so long; the same command goes on.")
    ] = None,
) -> None:
    """Train a teacher that knows the true state and chooses among pushes; a training that was stopped goes on."""
    settings = with_choices(
        find_preset(PRESETS, preset),
        iterations=iterations,
        falling_updates=falling_updates,
        learning_rate=learning_rate,
        seed=seed,
    )
    scenes, begun_with = open_training_scenes(split), None if start is None else open_checkpoint(start)

    def make(observe: Observer) -> TeacherTraining:
        return TeacherTraining(scenes, settings, out, start=begun_with, threads=threads, observe=observe)

    follow(make, _describe, name="training", iterations=settings.iterations, out=out, max_minutes=max_minutes)


def _describe(report: TeacherReport) -> str:
    if report.losses is None:
        return f"practising: {report.pushes:,} pushes"
    return f"training: {report.pushes:,} pushes, {report.losses.unexplained:.0%} of what they bring unexplained"
