"""The command ``dapl record``: interactions of any policy, to train a world model on."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from clutter6d import __version__
from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.termination import MAX_CONTROL_STEPS
from clutter6d.errors import InvalidValueError
from clutter6d.eval.cli import open_all_scenes
from clutter6d.eval.evaluator import ENGINE, EvaluationConfig, episode_keys
from clutter6d.eval.policy import Policy, PolicyOptions, is_planner
from clutter6d.eval.policy_loading import load_policy
from clutter6d.eval.runner import EpisodeRunner
from clutter6d.progress import progress_bars
from dapl_baselines.interactions.recorder import record_episodes, shuffled_keys
from dapl_baselines.interactions.recording import Recording
from dapl_baselines.interactions.shards import RecordingHeader
from dapl_baselines.interactions.sweep import SweepPolicy
from dapl_baselines.validation import part_scenes

_PARALLEL_EPISODES = 16


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
    collection, loaded = open_all_scenes(scenes), load_policy(policy, PolicyOptions(seed=seed, threads=threads))
    header = _make_header(collection, loaded, scenes, seed=seed, max_steps=max_steps)
    folder = out / f"{loaded.name}-{header.policy_hash[:8]}-seed{seed}"
    recording = Recording(folder, header)
    runner = EpisodeRunner(
        collection,
        loaded,
        config=EvaluationConfig(max_steps=max_steps).env(),
        seed=seed,
        num_envs=parallel or _parallel_episodes(loaded),
        threads=threads,
    )
    done, total = recording.keys, recording.steps
    keys = [key for key in shuffled_keys(episode_keys(collection, None), seed) if key not in done]
    console = Console(markup=False, emoji=False)
    with progress_bars(console) as progress:
        bar = progress.add_task("steps", total=steps, completed=min(total, steps))
        for episode in record_episodes(runner, keys) if total < steps else ():
            recording.add(episode)
            total += len(episode.actions)
            progress.update(bar, completed=min(total, steps))
            if total >= steps:
                break
    console.print(f"{total:,} steps of {len(recording.keys):,} episodes in {folder}", highlight=False, soft_wrap=True)
    if total < steps:
        console.print("all episodes of these scenes are recorded; for more, choose another --seed")


def _parallel_episodes(policy: Policy) -> int:
    """A policy that plans takes seconds an episode, so it runs one at a time: a kill then loses one, not sixteen."""
    return 1 if is_planner(policy) and not isinstance(policy, SweepPolicy) else _PARALLEL_EPISODES


def _make_header(scenes: SceneCollection, policy: Policy, where: str, *, seed: int, max_steps: int) -> RecordingHeader:
    objects = {len(scene.objects) for scene in scenes.scenes}
    if len(objects) != 1:
        raise InvalidValueError(f"{where} has scenes of {sorted(objects)} objects; record those of one track")
    return RecordingHeader(
        policy=policy.name,
        policy_hash=policy.policy_hash,
        scenes=where,
        split_sha256=scenes.sha256,
        validation_scenes=tuple(scene.scene_id for scene in part_scenes(scenes).validation.scenes),
        objects=objects.pop(),
        seed=seed,
        max_steps=max_steps,
        engine=ENGINE,
        clutter6d=__version__,
    )
