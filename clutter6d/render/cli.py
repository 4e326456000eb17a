"""The commands ``clutter6d render`` and ``clutter6d view``."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track

from clutter6d.errors import MissingFileError
from clutter6d.render.picture import Image
from clutter6d.render.scene_picture import picture_model, render_scene, render_turn
from clutter6d.render.sheet import contact_sheet, write_image
from clutter6d.render.video import write_video
from clutter6d.render.viewer import open_viewer
from clutter6d.scene import Scene
from clutter6d.scenegen.scene_set import SceneSet

VIDEO_FPS = 20
SHEET_COLUMNS = 4
SHEET_CELL_PX = 480
SHEET_FILE = "contact_sheet.png"

PathArgument = Annotated[Path, typer.Argument(help="A folder of generated scenes, or of one scene in it.")]
PairOption = Annotated[int, typer.Option(min=0, help="Goal pair to show; its goal is the green ghost.")]


def render(
    path: PathArgument,
    out: Annotated[Path | None, typer.Option(help="Folder for the pictures; by default PATH/pictures.")] = None,
    pair: PairOption = 0,
    backend: Annotated[str, typer.Option(help="auto, egl, osmesa or raycast (needs no OpenGL).")] = "auto",
    width: Annotated[int, typer.Option(help="Of a picture, in pixels.")] = 960,
    height: Annotated[int, typer.Option(help="Of a picture, in pixels.")] = 720,
    limit: Annotated[int, typer.Option(min=1, help="Draw at most so many scenes.")] = 64,
    video: Annotated[bool, typer.Option(help="Also make a video of each scene, the camera swinging.")] = False,
) -> None:
    """Draw two stills of each scene and a contact sheet of all."""
    console = Console()
    scene_set, scenes = find_scenes(path)
    folder = out or path / "pictures"
    overview: list[Image] = []
    shown = scenes[:limit]
    for scene in track(shown, description="drawing", console=console, transient=True):
        assets = scene_set.assets_of(scene)
        pictures = render_scene(scene, assets, pair, width=width, height=height, backend=backend)
        overview.append(pictures[1])
        for name, picture in zip(("scene", "table"), pictures, strict=True):
            write_image(folder / f"{scene.scene_id}_{name}.png", picture)
        if video:
            frames = render_turn(scene, assets, pair, width=width, height=height, backend=backend)
            write_video(frames, folder / f"{scene.scene_id}.mp4", VIDEO_FPS)
    sheet = contact_sheet(overview, [scene.scene_id for scene in shown], SHEET_COLUMNS, cell_width=SHEET_CELL_PX)
    write_image(folder / SHEET_FILE, sheet)
    left_out = f" (of {len(scenes)}; --limit allows more)" if len(scenes) > len(shown) else ""
    console.print(f"drew {len(shown)} scenes{left_out} to {folder}, all together in {folder / SHEET_FILE}")


def view(path: PathArgument, pair: PairOption = 0, scene: Annotated[str, typer.Option(help="Scene id.")] = "") -> None:
    """Open one scene in MuJoCo's interactive viewer, running; needs a display."""
    scene_set, scenes = find_scenes(path / "scenes" / scene if scene else path)
    shown = picture_model(scenes[0], scene_set.assets_of(scenes[0]), pair)
    open_viewer(shown)


def find_scenes(path: Path) -> tuple[SceneSet, Sequence[Scene]]:
    """The scenes that a path means, and the set they belong to.

    Args:
        path: A scene set's folder, or the folder ``scenes/<scene_id>`` of one scene in it.

    Raises:
        MissingFileError: It is neither.
        InvalidFileError: The set or the scene is damaged.
    """
    if not (path / "scene.json").is_file():
        return (scene_set := SceneSet.open(path)), scene_set.scenes
    scene_set = SceneSet.open(path.resolve().parent.parent)
    scenes = [scene for scene in scene_set.scenes if scene.scene_id == path.resolve().name]
    if not scenes:
        raise MissingFileError("scene", path, "give a folder of scenes, or scenes/<scene_id> in one")
    return scene_set, scenes
