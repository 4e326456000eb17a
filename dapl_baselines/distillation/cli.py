"""The command ``dapl distill``."""

from pathlib import Path
from typing import Annotated

import typer

from clutter6d.eval.policy import PolicyOptions
from clutter6d.eval.policy_loading import load_policy
from dapl_baselines.checkpoint import Precision
from dapl_baselines.distillation.iteration_report import DistillationReport
from dapl_baselines.distillation.settings import PRESETS
from dapl_baselines.distillation.training import Distillation
from dapl_baselines.policy.encoder_source import open_point_encoder
from dapl_baselines.preset_choices import find_preset, with_choices
from dapl_baselines.training_cli import follow
from dapl_baselines.validation import open_training_scenes
from dapl_baselines.validation_run import Observer


def distill(
    teacher: Annotated[
        str, typer.Option(help="Any policy: a name, such as planner; package.module:factory; or a .pt checkpoint.")
    ],
    encoder: Annotated[
        str,
        typer.Option(
            help="The .pt whose encoder it is; world-model, which comes along; or dapl or corn, with random weights."
        ),
    ],
    preset: Annotated[str, typer.Option(help=f"{' or '.join(PRESETS)}.")] = "laptop",
    split: Annotated[
        str, typer.Option(help="A frozen training split or a folder of scenes; one scene of 16 is held out.")
    ] = "sparse-train",
    out: Annotated[
        Path | None, typer.Option(help="Folder, by default trainings/distilled-TEACHER-PRESET; one left goes on.")
    ] = None,
    envs: Annotated[int | None, typer.Option(min=1, help="Environments; default the preset's.")] = None,
    iterations: Annotated[int | None, typer.Option(min=1, help="Rollouts in all; default the preset's.")] = None,
    teacher_iterations: Annotated[
        int | None, typer.Option(min=0, help="Rollouts until the teacher acts nowhere; default the preset's.")
    ] = None,
    noise: Annotated[
        float | None, typer.Option(min=0, max=1, help="Deviation of the student's points [m] and velocities [m/s].")
    ] = None,
    latent_weight: Annotated[
        float | None, typer.Option(min=0, help="Weight of the latent loss; 0: the student learns actions alone.")
    ] = None,
    history: Annotated[
        int | None,
        typer.Option(
            min=1, max=16, help="Frames the student sees, one every 0.1 s; 1: no memory; default the preset's."
        ),
    ] = None,
    train_encoder: Annotated[bool, typer.Option(help="Let the encoder learn too; takes far longer.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything drawn.")] = 0,
    threads: Annotated[int, typer.Option(min=0, help="Threads of simulation and teacher; 0 for all cores.")] = 0,
    precision: Annotated[
        Precision, typer.Option(help="Of the weights in checkpoints; float16 takes half the room.")
    ] = "float32",
    max_minutes: Annotated[
        float | None, typer.Option(min=0, help="Stop after so long; the same command goes on.")
    ] = None,
) -> None:
    """Distil a teacher into a policy that sees points alone; killed at any time, the same command goes on."""
    chosen = find_preset(PRESETS, preset)
    settings = with_choices(
        chosen,
        network=None if history is None else chosen.network.model_dump() | {"history": history},
        envs=envs,
        iterations=iterations,
        teacher_iterations=teacher_iterations,
        noise_sigma=noise,
        latent_weight=latent_weight,
        trains_encoder=train_encoder,
        seed=seed,
        stored_precision=precision,
    )
    scenes, source = open_training_scenes(split), open_point_encoder(encoder, seed)
    policy = load_policy(teacher, PolicyOptions(seed=seed, threads=threads))
    out = out or Path("trainings") / f"distilled-{policy.name}-{preset}"

    def make(observe: Observer) -> Distillation:
        return Distillation(scenes, settings, out, teacher=policy, encoder=source, threads=threads, observe=observe)

    follow(make, _describe, name="distilling", iterations=settings.iterations, out=out, max_minutes=max_minutes)


def _describe(report: DistillationReport) -> str:
    return f"distilling: action loss {report.losses.action:.4f}"
