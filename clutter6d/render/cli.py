"""The commands ``clutter6d render`` and ``clutter6d view``."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track

from clutter6d.assets.library import LIBRARY_FILE, AssetLibrary
from clutter6d.dataset.scenes import SceneCollection, find_scenes, open_scenes
from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.eval.cli import SCENES_FILE, ScenesLocation
from clutter6d.eval.evaluator import REPORT_FILE
from clutter6d.eval.motion import replay_motions
from clutter6d.render.asset_picture import render_assets
from clutter6d.render.camera import EPISODE_VIEW
from clutter6d.render.picture import Image, render_rollout
from clutter6d.render.scene_picture import picture_model, render_scene, render_turn
from clutter6d.render.sheet import contact_sheet, write_image
from clutter6d.render.video import write_video
from clutter6d.render.viewer import open_viewer
from clutter6d.scene import Scene
from clutter6d.schema import read_model

VIDEO_FPS = 20
SHEET_COLUMNS = 4
ASSET_COLUMNS = 12
SHEET_CELL_PX = 480
SHEET_FILE = "contact_sheet.png"
DEFAULT_SIZE_PX = (960, 720)

PathArgument = Annotated[
    Path, typer.Argument(help="A folder of scenes, of one scene, of an evaluation, or of assets; or a split.")
]
PairOption = Annotated[int, typer.Option(min=0, help="Goal pair to show; its goal is the green ghost.")]


def render(
    path: PathArgument,
    out: Annotated[Path | None, typer.Option(help="Folder for the pictures; by default PATH/pictures.")] = None,
    pair: PairOption = 0,
    backend: Annotated[str, typer.Option(help="auto, egl, osmesa or raycast (needs no OpenGL).")] = "auto",
    width: Annotated[int, typer.Option(help="Of a picture, in pixels.")] = DEFAULT_SIZE_PX[0],
    height: Annotated[int, typer.Option(help="Of a picture, in pixels.")] = DEFAULT_SIZE_PX[1],
    limit: Annotated[int, typer.Option(min=1, help="Draw at most so many scenes, episodes or assets.")] = 64,
    video: Annotated[bool, typer.Option(help="Also make a video of each scene, the camera swinging.")] = False,
    scenes: Annotated[str | None, typer.Option(help="Scenes of an evaluation, if they are elsewhere now.")] = None,
) -> None:
    """Draw two stills of each scene and a contact sheet; or a video of each episode; or a sheet of all assets.

    Videos of episodes run at twice real time.
    """
    folder = out or (path / "pictures" if path.exists() else Path("pictures") / path)
    console = Console(markup=False, emoji=False)
    task = _Task(folder=folder, width=width, height=height, backend=backend, console=console)
    if (path / LIBRARY_FILE).is_file():
        _draw_library(AssetLibrary.open(path), limit, task)
        return
    if (path / REPORT_FILE).is_file():
        shown = _draw_episodes(path, scenes, limit, task)
        console.print(f"drew {len(shown)} episodes to {folder}, their ends together in {folder / SHEET_FILE}")
    else:
        collection, found = find_scenes(path)
        shown = _draw_scenes(collection, found[:limit], pair, video, task)
        left_out = f" (of {len(found)}; --limit allows more)" if len(found) > len(shown) else ""
        console.print(f"drew {len(shown)} scenes{left_out} to {folder}, all together in {folder / SHEET_FILE}")
    sheet = contact_sheet(list(shown.values()), list(shown), SHEET_COLUMNS, cell_width=SHEET_CELL_PX)
    write_image(folder / SHEET_FILE, sheet)


def view(path: PathArgument, pair: PairOption = 0, scene: Annotated[str, typer.Option(help="Scene id.")] = "") -> None:
    """Open one scene in MuJoCo's interactive viewer, running; needs a display."""
    scenes, found = find_scenes(path)
    chosen = next((item for item in found if item.scene_id == scene), None) if scene else found[0]
    if chosen is None:
        raise UnknownNameError(f"scene of {path}", scene, [item.scene_id for item in found])
    shown = picture_model(chosen, scenes.assets_of(chosen), pair)
    open_viewer(shown)


@dataclass(frozen=True, kw_only=True, slots=True)
class _Task:
    """Where pictures go and what they are like."""

    folder: Path
    width: int
    height: int
    backend: str
    console: Console


def _draw_library(library: AssetLibrary, limit: int, task: _Task) -> None:
    """Write one sheet of a library's assets, each in its most probable resting orientation."""
    names = library.names()[:limit]
    shown = track(names, description="drawing assets", console=task.console, transient=True)
    sheet = render_assets((library.load(name) for name in shown), columns=ASSET_COLUMNS, backend=task.backend)
    write_image(task.folder / SHEET_FILE, sheet)
    left_out = f" (of {len(library.names())}; --limit allows more)" if len(library.names()) > len(names) else ""
    task.console.print(f"drew {len(names)} assets{left_out} to {task.folder / SHEET_FILE}")


def _draw_scenes(
    collection: SceneCollection, scenes: Sequence[Scene], pair: int, is_moving: bool, task: _Task
) -> dict[str, Image]:
    """Write stills (and videos) of scenes; returns one picture of each for the contact sheet."""
    shown: dict[str, Image] = {}
    for scene in track(scenes, description="drawing scenes", console=task.console, transient=True):
        assets = collection.assets_of(scene)
        pictures = render_scene(scene, assets, pair, width=task.width, height=task.height, backend=task.backend)
        shown[scene.scene_id] = pictures[1]
        for name, picture in zip(("scene", "table"), pictures, strict=True):
            write_image(task.folder / f"{scene.scene_id}_{name}.png", picture)
        if is_moving:
            frames = render_turn(scene, assets, pair, width=task.width, height=task.height, backend=task.backend)
            write_video(frames, task.folder / f"{scene.scene_id}.mp4", VIDEO_FPS)
    return shown


def _draw_episodes(path: Path, scenes: str | None, limit: int, task: _Task) -> dict[str, Image]:
    """Write a video of each episode; returns the last frame of each for the contact sheet."""
    found = scenes or read_model(path / SCENES_FILE, ScenesLocation, what="scenes of the evaluation").scenes
    collection = open_scenes(found)
    motions = islice(replay_motions(path, collection), limit)
    shown: dict[str, Image] = {}
    for motion in track(motions, description="drawing episodes", console=task.console, transient=True, total=None):
        scene, row = motion.scene, motion.row
        model = picture_model(scene, collection.assets_of(scene), row.pair).model
        frames = render_rollout(
            model, motion.qpos, EPISODE_VIEW, width=task.width, height=task.height, backend=task.backend
        )
        label = f"{scene.scene_id} pair {row.pair}: {row.outcome}"
        video = task.folder / f"{scene.scene_id}_pair{row.pair}_{row.outcome}.mp4"
        write_video(_keep_last(frames, shown, label), video, VIDEO_FPS)
    if not shown:
        raise InvalidValueError(f"{path}: the evaluation has no episodes to draw")
    return shown


def _keep_last(frames: Iterator[Image], shown: dict[str, Image], label: str) -> Iterator[Image]:
    for frame in frames:
        shown[label] = frame
        yield frame
