"""The command ``dapl train policy``."""

from pathlib import Path
from typing import Annotated

import typer

from dapl_baselines.checkpoint import Precision
from dapl_baselines.devices import find_device
from dapl_baselines.policy.config import StatePart
from dapl_baselines.policy.encoder_source import open_encoder
from dapl_baselines.policy.iteration_report import IterationReport
from dapl_baselines.policy.policy_start import open_start
from dapl_baselines.policy.settings import PRESETS, TrainingSettings
from dapl_baselines.policy.training import PolicyTraining
from dapl_baselines.preset_choices import find_preset, with_choices
from dapl_baselines.training_cli import follow
from dapl_baselines.validation import TrainingScenes, open_training_scenes
from dapl_baselines.validation_run import Observer


def train_policy(
    encoder: Annotated[
        str,
        typer.Option(
            help="none; dapl or corn, random weights; world-model, which comes along; or the .pt whose encoder it is."
        ),
    ] = "none",
    start: Annotated[
        Path | None, typer.Option(help="A policy's .pt to begin with: its weights, all but the encoder's.")
    ] = None,
    preset: Annotated[str, typer.Option(help=f"{' or '.join(PRESETS)}.")] = "laptop",
    split: Annotated[
        str, typer.Option(help="A frozen training split or a folder of scenes; one scene of 16 is held out.")
    ] = "sparse-train",
    out: Annotated[
        Path | None,
        typer.Option(help="Folder, by default trainings/policy-ENCODER-PRESET; one that was left goes on."),
    ] = None,
    envs: Annotated[int | None, typer.Option(min=1, help="Environments; default the preset's.")] = None,
    iterations: Annotated[int | None, typer.Option(min=1, help="Rollouts in all; default the preset's.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything drawn.")] = 0,
    physics: Annotated[
        bool, typer.Option(help="Whether the policy sees the physics parameters, which only a simulation knows.")
    ] = True,
    objects: Annotated[
        bool, typer.Option(help="Whether it sees the true states of all objects, as a teacher may.")
    ] = False,
    device: Annotated[str, typer.Option(help="cpu or cuda; on several GPUs, start it by torchrun.")] = "cpu",
    threads: Annotated[int, typer.Option(min=0, help="Threads of the simulation; 0 for all cores.")] = 0,
    precision: Annotated[
        Precision, typer.Option(help="Of the weights in checkpoints; float16 takes half the room.")
    ] = "float32",
    max_minutes: Annotated[
        float | None, typer.Option(min=0, help="Stop after so long; the same command goes on.")
    ] = None,
) -> None:
    """Train a policy by PPO on a frozen encoder; killed at any time, the same command goes on as if it had not been."""
    find_device(device)
    scenes, source = open_training_scenes(split), open_encoder(encoder, seed)
    begun_with = None if start is None else open_start(start)
    settings = with_choices(
        find_preset(PRESETS, preset), envs=envs, iterations=iterations, seed=seed, stored_precision=precision
    )
    settings = _with_state(settings, scenes, has_physics=physics, has_objects=objects)
    out = out or Path("trainings") / f"policy-{Path(encoder).stem}-{preset}"

    def make(observe: Observer) -> PolicyTraining:
        return PolicyTraining(
            scenes,
            settings,
            out,
            encoder=source,
            start=begun_with,
            device=device,
            threads=threads,
            observe=observe,
        )

    follow(make, _describe, name="training", iterations=settings.iterations, out=out, max_minutes=max_minutes)


def _with_state(
    settings: TrainingSettings, scenes: TrainingScenes, *, has_physics: bool, has_objects: bool
) -> TrainingSettings:
    """The settings, with the parts of the state that are wanted."""
    wanted: dict[StatePart, bool] = {"physics_parameters": has_physics, "object_states": has_objects}
    parts = [part for part in settings.network.state_parts if wanted.get(part, True)]
    if has_objects:
        parts.append("object_states")
    count = len(scenes.training.scenes[0].objects) if has_objects else 0
    network = settings.network.model_copy(update={"state_parts": tuple(parts), "objects": count})
    return settings.model_copy(update={"network": network})


def _describe(report: IterationReport) -> str:
    episodes = report.episodes
    if not episodes.episodes:
        return "training"
    return f"training: return {episodes.episode_return:.1f}, {episodes.success_rate:.1%} success"
