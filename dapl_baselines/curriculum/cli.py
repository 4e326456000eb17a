"""The command ``dapl curriculum``."""

from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from clutter6d.progress import BarsByName, progress_bars
from dapl_baselines.curriculum.curriculum import Curriculum
from dapl_baselines.curriculum.settings import PRESETS
from dapl_baselines.preset_choices import find_preset, with_choices
from dapl_baselines.validation import open_training_scenes
from dapl_baselines.world_model.presets import find_model


def curriculum(
    preset: Annotated[str, typer.Option(help=f"{' or '.join(PRESETS)}.")] = "laptop",
    scenes: Annotated[
        str, typer.Option(help="A frozen training split or a folder of scenes; one scene of 16 is held out.")
    ] = "sparse-train",
    out: Annotated[
        Path | None, typer.Option(help="Folder, by default trainings/curriculum-PRESET; one that was left goes on.")
    ] = None,
    rounds: Annotated[int | None, typer.Option(min=1, help="Rounds in all; default the preset's.")] = None,
    record_steps: Annotated[
        int | None, typer.Option(min=1, help="Control steps recorded in a round; default the preset's.")
    ] = None,
    random_share: Annotated[
        float | None, typer.Option(min=0, max=1, help="Share of the first round's steps that are random residuals.")
    ] = None,
    model: Annotated[
        str, typer.Option(help="World model: a row of the ablation, as points, or a JSON file of a configuration.")
    ] = "points",
    world_model_steps: Annotated[
        int | None, typer.Option(min=1, help="Optimiser steps of a round's world model; default the preset's.")
    ] = None,
    world_model_minutes: Annotated[
        float | None, typer.Option(min=0.01, help="Minutes of a round's world model; default the preset's.")
    ] = None,
    policy_iterations: Annotated[
        int | None, typer.Option(min=1, help="Rollouts of a round's policy; default the preset's.")
    ] = None,
    envs: Annotated[int | None, typer.Option(min=1, help="Environments; default the preset's.")] = None,
    max_steps: Annotated[
        int | None, typer.Option(min=2, max=1_000, help="Steps of an episode at most, in all stages.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything drawn.")] = 0,
    device: Annotated[str, typer.Option(help="cpu or cuda.")] = "cpu",
    threads: Annotated[int, typer.Option(min=0, help="Threads of the simulation; 0 for all cores.")] = 0,
) -> None:
    """Train world model and policy in turn, unattended; killed at any time, the same command goes on."""
    chosen = find_preset(PRESETS, preset)
    settings = with_choices(
        chosen,
        rounds=rounds,
        record_steps=record_steps,
        record_max_steps=max_steps,
        random_share=random_share,
        model=find_model(model),
        train=with_choices(chosen.train, steps=world_model_steps, minutes=world_model_minutes),
        policy=with_choices(chosen.policy, iterations=policy_iterations, envs=envs, max_steps=max_steps),
        seed=seed,
    )
    out, parted = out or Path("trainings") / f"curriculum-{preset}", open_training_scenes(scenes)
    console = Console(markup=False, emoji=False)
    with progress_bars(console) as progress:
        observe = BarsByName(progress).update
        whole = Curriculum(parted, settings, out, scenes_name=scenes, device=device, threads=threads, observe=observe)
        with closing(whole.run()) as results:
            for result in results:
                progress.console.print(result.describe(), highlight=False, soft_wrap=True)
    made = f"{len(whole.results)} rounds are made; written to {out}"
    console.print(made, highlight=False, soft_wrap=True)
