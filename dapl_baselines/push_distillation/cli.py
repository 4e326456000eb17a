"""The command ``dapl distill-pushes``."""

from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from clutter6d.errors import InvalidValueError
from clutter6d.progress import BarsByName, progress_bars
from dapl_baselines.checkpoint import read_checkpoint
from dapl_baselines.policy.encoder_source import open_encoder
from dapl_baselines.preset_choices import find_preset, with_choices
from dapl_baselines.push_distillation.iteration_report import StudentReport
from dapl_baselines.push_distillation.settings import PRESETS
from dapl_baselines.push_distillation.training import PushDistillation
from dapl_baselines.training_report import until
from dapl_baselines.validation import open_training_scenes


def distill_pushes(
    teacher: Annotated[Path, typer.Option(help="The teacher's .pt, of dapl train teacher.")],
    encoder: Annotated[
        str, typer.Option(help="The .pt of a world model or policy, whose frozen encoder it is; dapl: random weights.")
    ],
    preset: Annotated[str, typer.Option(help=f"{' or '.join(PRESETS)}.")] = "laptop",
    split: Annotated[
        str, typer.Option(help="A frozen training split or a folder of scenes; one scene of 16 is held out.")
    ] = "sparse-train",
    out: Annotated[Path, typer.Option(help="Folder; a distillation that was left goes on.")] = Path(
        "trainings/push-student"
    ),
    iterations: Annotated[int | None, typer.Option(min=1, help="Iterations in all; default the preset's.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything drawn.")] = 0,
    threads: Annotated[int, typer.Option(min=0, help="Threads of the simulation; 0 for all cores.")] = 0,
    max_minutes: Annotated[
        float | None, typer.Option(min=0, help="Stop after so long; the same command goes on.")
    ] = None,
) -> None:
    """Distil a teacher that chooses among pushes into one that sees points alone, through DAPL's encoder."""
    settings = with_choices(find_preset(PRESETS, preset), iterations=iterations, seed=seed)
    scenes, checkpoint, source = open_training_scenes(split), read_checkpoint(teacher), open_encoder(encoder, seed)
    if source is None:
        raise InvalidValueError("a student sees points; give --encoder dapl or the .pt of a world model or policy")
    console = Console(markup=False, emoji=False)
    with progress_bars(console) as progress:
        observe = BarsByName(progress).update
        training = PushDistillation(
            scenes, settings, out, teacher=checkpoint, encoder=source, threads=threads, observe=observe
        )
        bar = progress.add_task("distilling", total=settings.iterations, completed=training.standing.iteration)
        with closing(training.run()) as reports:
            for report in until(reports, max_minutes):
                progress.update(bar, completed=report.iteration, description=_describe(report))
                if report.validation is not None:
                    progress.console.print(report.describe_look(), highlight=False)
    made = training.standing.iteration
    console.print(f"{made} of {settings.iterations} iterations are made; written to {out}", highlight=False)


def _describe(report: StudentReport) -> str:
    if report.losses is None:
        return f"practising: {report.lessons:,} states"
    return f"distilling: agrees with the teacher in {report.losses.agreement:.0%}"
