"""The command ``dapl validate``."""

from typing import Annotated

import typer
from rich.console import Console

from clutter6d.eval.policy import PolicyOptions, is_planner
from clutter6d.eval.policy_loading import load_policy
from clutter6d.progress import BarsByName, progress_bars
from dapl_baselines.validation import open_training_scenes
from dapl_baselines.validation_run import PARALLEL_EPISODES, run_validation


def validate(
    policy: Annotated[str, typer.Option(help="A name, package.module:factory, or a .pt checkpoint.")],
    split: Annotated[
        str, typer.Option(help="A frozen training split or a folder of scenes, of which one of 16 is held out.")
    ] = "sparse-train",
    pairs: Annotated[int, typer.Option(min=1, max=16, help="Goal pairs of each scene; trainings look at 1.")] = 1,
    threads: Annotated[int, typer.Option(min=0, help="Threads of the simulation; 0 for all cores.")] = 0,
) -> None:
    """Say how a policy does on the scenes that trainings hold out; test splits are for the end."""
    loaded, scenes = load_policy(policy, PolicyOptions(threads=threads)), open_training_scenes(split).validation
    console = Console(markup=False, emoji=False)
    at_once = 1 if is_planner(loaded) else PARALLEL_EPISODES
    with progress_bars(console) as progress:
        observe = BarsByName(progress).update
        result = run_validation(loaded, scenes, pairs=pairs, num_envs=at_once, threads=threads, observe=observe)
    console.print(
        f"{loaded.name}: {result.success_rate:.1%} of {result.episodes} episodes succeed; an episode takes "
        f"{result.steps:.0f} steps and moves the others by {result.mean_offset_cm:.1f} cm",
        highlight=False,
    )
