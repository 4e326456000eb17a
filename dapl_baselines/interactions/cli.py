"""The command ``dapl record``: interactions of any policy, to train a world model on."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from clutter6d.envs.termination import MAX_CONTROL_STEPS
from clutter6d.eval.cli import open_all_scenes
from clutter6d.eval.policy import PolicyOptions
from clutter6d.eval.policy_loading import load_policy
from clutter6d.progress import progress_bars
from dapl_baselines.interactions.policy_recording import PolicyRecording


def record(
    policy: Annotated[
        str, typer.Option(help="sweep, random, planner, zero, package.module:factory, or a .pt checkpoint.")
    ] = "sweep",
    scenes: Annotated[
        str, typer.Option(help="A frozen split, such as sparse-train, or a folder made by clutter6d generate.")
    ] = "sparse-train",
    steps: Annotated[int, typer.Option(min=1, help="Control steps to record, in whole episodes.")] = 60_000,
    out: Annotated[Path, typer.Option(help="Folder of the data set; each policy and seed has a folder in it.")] = Path(
        "interactions"
    ),
    parallel: Annotated[
        int | None,
        typer.Option(min=1, help="Episodes that run at once; default 16, or 1 for a policy that plans."),
    ] = None,
    threads: Annotated[int, typer.Option(min=0, help="Threads; 0 for all cores.")] = 0,
    seed: Annotated[int, typer.Option(help="Of what the policy draws, and of the order of the episodes.")] = 0,
    max_steps: Annotated[int, typer.Option(min=2, max=1_000, help="Steps of an episode at most.")] = MAX_CONTROL_STEPS,
) -> None:
    """Record what a policy does: states and actions; the same command goes on where it was stopped."""
    recording = PolicyRecording(
        open_all_scenes(scenes),
        load_policy(policy, PolicyOptions(seed=seed, threads=threads)),
        out,
        scenes_name=scenes,
        seed=seed,
        max_steps=max_steps,
        parallel=parallel,
        threads=threads,
    )
    console = Console(markup=False, emoji=False)
    with progress_bars(console) as progress:
        bar = progress.add_task("steps", total=steps, completed=min(recording.steps, steps))
        for total in recording.run(steps):
            progress.update(bar, completed=min(total, steps))
    made = f"{recording.steps:,} steps of {recording.episodes:,} episodes in {recording.folder}"
    console.print(made, highlight=False, soft_wrap=True)
    if recording.steps < steps:
        console.print("all episodes of these scenes are recorded; for more, choose another --seed")
