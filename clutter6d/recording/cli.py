"""The command ``clutter6d record``."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.termination import MAX_CONTROL_STEPS
from clutter6d.errors import InvalidValueError, MissingFileError
from clutter6d.eval.cli import PARALLEL_EPISODES, SCENES_FILE, ScenesLocation, open_all_scenes, remember_scenes
from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.eval.policy import PolicyOptions, is_planner
from clutter6d.eval.policy_loading import load_policy
from clutter6d.progress import progress_bars
from clutter6d.recording.formats import RecordingPlan, find_formats
from clutter6d.recording.recording import record_episodes
from clutter6d.recording.source import RecordedEpisodes, read_evaluation, spread_keys
from clutter6d.schema import read_model

DEFAULT_EPISODES = 10
DEFAULT_SCENES = "sparse-test"
EPISODES_FOLDER = "episodes"


def record(
    evaluation: Annotated[
        Path | None, typer.Argument(help="What clutter6d evaluate or teleop wrote; or give --policy.")
    ] = None,
    policy: Annotated[
        str | None, typer.Option(help="zero, random, planner, package.module:factory, or a .pt checkpoint.")
    ] = None,
    scenes: Annotated[
        str | None,
        typer.Option(help="A split or a folder of scenes; by default sparse-test, or where the evaluation's were."),
    ] = None,
    format: Annotated[  # noqa: A002
        list[str] | None, typer.Option(help="video (MP4), gif, parquet or lerobot; may be given several times.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the recording, by default recordings/NAME; continued if unfinished.")
    ] = None,
    episodes: Annotated[
        int | None,
        typer.Option(min=1, help="Episodes, over as many scenes as there are; default 10, or the evaluation's."),
    ] = None,
    only_successes: Annotated[bool, typer.Option("--only-successes", help="Leave out what did not succeed.")] = False,
    point_clouds: Annotated[
        bool, typer.Option("--point-clouds", help="Keep the point clouds too (36 KB a step); parquet and lerobot.")
    ] = False,
    cameras: Annotated[
        str | None, typer.Option(help="Cameras, parted by commas; 'none' for a lerobot data set without pictures.")
    ] = None,
    width: Annotated[
        int | None, typer.Option(min=1, help="Of the pictures, in pixels; by default the format's.")
    ] = None,
    height: Annotated[
        int | None, typer.Option(min=1, help="Of the pictures, in pixels; by default the format's.")
    ] = None,
    fps: Annotated[
        int, typer.Option(min=1, max=100, help="Control steps a second of a video or GIF; 10 is real time.")
    ] = 20,
    backend: Annotated[str, typer.Option(help="auto, egl, osmesa or raycast (needs no OpenGL).")] = "auto",
    num_envs: Annotated[
        int | None, typer.Option(min=1, help="Episodes that run at once; default 16, or 1 for a planner.")
    ] = None,
    threads: Annotated[int, typer.Option(min=0, help="Threads of the simulation; 0 for all cores.")] = 0,
    seed: Annotated[int, typer.Option(help="Seed of everything the policy draws.")] = 0,
    max_steps: Annotated[int, typer.Option(min=1, help="Steps of an episode at most.")] = MAX_CONTROL_STEPS,
) -> None:
    """Record episodes of a policy or of an evaluation as videos, as Parquet tables or as a LeRobot data set."""
    plan = RecordingPlan(
        formats=find_formats(format or ["video"]),
        cameras=cameras,
        width=width,
        height=height,
        fps=fps,
        backend=backend,
        point_clouds=point_clouds,
    )
    console = Console(markup=False, emoji=False)
    if evaluation is not None and policy is None:
        found, out = _open_recorded(evaluation, scenes), out or Path("recordings") / evaluation.resolve().name
    elif policy is not None and evaluation is None:
        config = EvaluationConfig(seed=seed, max_steps=max_steps)
        run = _open_run(policy, scenes or DEFAULT_SCENES, out, config, threads)
        found, out = _run_episodes(run, episodes or DEFAULT_EPISODES, num_envs, threads, console), run.out
    else:
        raise InvalidValueError("give either the folder of an evaluation or --policy NAME")
    chosen = found.chosen(count=episodes, only_successes=only_successes)
    recorders = [plan.recorder(name, out, chosen) for name in plan.formats]
    with progress_bars(console) as progress:
        bar = progress.add_task(f"recording {', '.join(plan.formats)}", total=len(chosen.records))
        for _ in record_episodes(chosen, recorders, point_clouds=point_clouds):
            progress.advance(bar)
        joining = progress.add_task("putting together", total=len(recorders))
        for recorder in recorders:
            progress.console.print(f"recorded {len(chosen.records)} episodes in {recorder.finish()}")
            progress.advance(joining)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class _Run:
    """A policy's episodes, kept as those of an evaluation are."""

    out: Path
    scenes: SceneCollection
    evaluation: Evaluation
    is_planner: bool

    @property
    def folder(self) -> Path:
        """Where they are kept."""
        return self.out / EPISODES_FOLDER


def _open_run(policy: str, scenes: str, out: Path | None, config: EvaluationConfig, threads: int) -> _Run:
    collection = open_all_scenes(scenes)
    loaded = load_policy(policy, PolicyOptions(seed=config.seed, threads=threads))
    out = out or Path("recordings") / f"{loaded.name}-{Path(scenes).name}"
    evaluation = Evaluation(collection, loaded, out / EPISODES_FOLDER, config)
    remember_scenes(out / EPISODES_FOLDER, scenes)
    return _Run(out=out, scenes=collection, evaluation=evaluation, is_planner=is_planner(loaded))


def _run_episodes(run: _Run, count: int, num_envs: int | None, threads: int, console: Console) -> RecordedEpisodes:
    """Run the policy's episodes that are not kept yet."""
    keys = spread_keys(run.evaluation.keys, count)
    done = len(run.evaluation.finished(keys=keys))
    at_once = num_envs or (1 if run.is_planner else PARALLEL_EPISODES)
    with progress_bars(console) as progress:
        bar = progress.add_task("running the policy", total=len(keys), completed=done)
        for _ in run.evaluation.run(keys=keys, num_envs=at_once, threads=threads):
            progress.advance(bar)
    return read_evaluation(run.folder, run.scenes)


def _open_recorded(folder: Path, scenes: str | None) -> RecordedEpisodes:
    if not folder.is_dir():
        raise MissingFileError("evaluation", folder, "make one with: clutter6d evaluate")
    found = scenes or read_model(folder / SCENES_FILE, ScenesLocation, what="scenes of the evaluation").scenes
    return read_evaluation(folder, open_all_scenes(found))
