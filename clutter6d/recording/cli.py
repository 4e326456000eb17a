"""The command ``clutter6d record``."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from clutter6d.dataset.scenes import SceneCollection, open_scenes
from clutter6d.envs.termination import MAX_CONTROL_STEPS
from clutter6d.errors import InvalidValueError, MissingFileError, UnknownNameError
from clutter6d.eval.cli import PARALLEL_EPISODES, SCENES_FILE, ScenesLocation
from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.eval.policy import PolicyOptions
from clutter6d.eval.policy_loading import load_policy
from clutter6d.eval.report import RunSettings
from clutter6d.progress import progress_bars
from clutter6d.recording.cameras import SENSORS, find_cameras
from clutter6d.recording.lerobot_features import FPS
from clutter6d.recording.lerobot_recorder import LeRobotRecorder
from clutter6d.recording.recording import Recorder, RecordingSettings, record_episodes
from clutter6d.recording.rollout_file import RolloutRecorder
from clutter6d.recording.source import RecordedEpisodes, read_evaluation, spread_keys
from clutter6d.recording.video_file import VideoRecorder
from clutter6d.schema import read_model

FOLDERS = {"video": "videos", "gif": "gifs", "parquet": "rollouts", "lerobot": "lerobot"}
DEFAULT_EPISODES = 10
DEFAULT_SCENES = "sparse-test"
DEFAULT_CAMERAS = {"video": "episode", "gif": "episode", "lerobot": ",".join(SENSORS)}
DEFAULT_SIZE_PX = {"video": (960, 720), "gif": (480, 360), "lerobot": (320, 240)}
EPISODES_FOLDER = "episodes"
NO_CAMERAS = "none"


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
    width: Annotated[int, typer.Option(min=0, help="Of the pictures, in pixels; 0 for the format's own.")] = 0,
    height: Annotated[int, typer.Option(min=0, help="Of the pictures, in pixels; 0 for the format's own.")] = 0,
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
    plan = _Plan(
        formats=_checked_formats(format or ["video"]),
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
    for recorder in recorders:
        console.print(f"recorded {len(chosen.records)} episodes in {recorder.finish()}")


@dataclass(frozen=True, kw_only=True, slots=True)
class _Plan:
    """What is recorded, and how it is drawn; sizes of 0 and cameras of ``None`` mean the format's own."""

    formats: tuple[str, ...]
    cameras: str | None
    width: int
    height: int
    fps: int
    backend: str
    point_clouds: bool

    def __post_init__(self) -> None:
        """Refuse cameras that are not there before anything is run."""
        for name in self.formats:
            self._cameras(name)

    def recorder(self, name: str, out: Path, episodes: RecordedEpisodes) -> Recorder:
        """What writes one format."""
        folder, settings = out / FOLDERS[name], self._settings(name, episodes.settings)
        if name == "parquet":
            return RolloutRecorder(folder, settings, episodes.keys)
        if name == "lerobot":
            return LeRobotRecorder(folder, settings, episodes.keys, self.backend)
        return VideoRecorder(folder, settings, ".gif" if name == "gif" else ".mp4", self.backend)

    def _settings(self, name: str, run: RunSettings) -> RecordingSettings:
        clouds = self.point_clouds and name in ("parquet", "lerobot")
        cameras = self._cameras(name)
        if not cameras:
            return RecordingSettings(run=run, point_clouds=clouds)
        width, height = DEFAULT_SIZE_PX[name]
        return RecordingSettings(
            run=run,
            point_clouds=clouds,
            cameras=cameras,
            width=self.width or width,
            height=self.height or height,
            fps=FPS if name == "lerobot" else self.fps,
        )

    def _cameras(self, name: str) -> tuple[str, ...]:
        if name not in DEFAULT_CAMERAS or (name == "lerobot" and self.cameras == NO_CAMERAS):
            return ()
        return find_cameras((self.cameras or DEFAULT_CAMERAS[name]).split(","))


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
    collection = open_scenes(scenes)
    loaded = load_policy(policy, PolicyOptions(seed=config.seed, threads=threads))
    out = out or Path("recordings") / f"{loaded.name}-{Path(scenes).name}"
    evaluation = Evaluation(collection, loaded, out / EPISODES_FOLDER, config)
    return _Run(out=out, scenes=collection, evaluation=evaluation, is_planner=loaded.is_privileged)


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
    return read_evaluation(folder, open_scenes(found))


def _checked_formats(names: Sequence[str]) -> tuple[str, ...]:
    for name in names:
        if name not in FOLDERS:
            raise UnknownNameError("format", name, FOLDERS)
    return tuple(dict.fromkeys(names))
