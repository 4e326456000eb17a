"""The command ``dapl distill-pushes``."""

from pathlib import Path
from typing import Annotated

import typer

from dapl_baselines.bundled import open_checkpoint
from dapl_baselines.policy.encoder_source import open_point_encoder
from dapl_baselines.preset_choices import find_preset, with_choices
from dapl_baselines.push_distillation.iteration_report import StudentReport
from dapl_baselines.push_distillation.settings import PRESETS
from dapl_baselines.push_distillation.training import PushDistillation
from dapl_baselines.training_cli import follow
from dapl_baselines.validation import open_training_scenes
from dapl_baselines.validation_run import Observer


def distill_pushes(
    teacher: Annotated[str, typer.Option(help="The .pt of dapl train teacher; or push-teacher, which comes along.")],
    encoder: Annotated[
        str,
        typer.Option(
            help="The .pt whose frozen encoder it is; world-model, which comes along; or dapl or corn, random weights."
        ),
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
    """Distil a teacher that chooses among pushes into one that sees points alone, through a frozen encoder."""
    settings = with_choices(find_preset(PRESETS, preset), iterations=iterations, seed=seed)
    scenes, checkpoint = open_training_scenes(split), open_checkpoint(teacher)
    source = open_point_encoder(encoder, seed)

    def make(observe: Observer) -> PushDistillation:
        return PushDistillation(
            scenes, settings, out, teacher=checkpoint, encoder=source, threads=threads, observe=observe
        )

    follow(make, _describe, name="distilling", iterations=settings.iterations, out=out, max_minutes=max_minutes)


def _describe(report: StudentReport) -> str:
    if report.losses is None:
        return f"practising: {report.lessons:,} states"
    return f"distilling: agrees with the teacher in {report.losses.agreement:.0%}"
