"""The command ``clutter6d export``."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track

from clutter6d.dataset.scenes import SceneCollection, find_scenes
from clutter6d.errors import InvalidValueError
from clutter6d.export.formats import FORMATS, export_scene, parse_formats
from clutter6d.scene import Scene

FORMATS_HELP = f"Formats, separated by commas: {', '.join(FORMATS)}."


def export(
    scene: Annotated[
        str, typer.Argument(help="A folder of scenes or of one scene, a frozen split, or SPLIT/SCENE_ID.")
    ],
    formats: Annotated[str, typer.Option("--format", help=FORMATS_HELP)],
    out: Annotated[Path, typer.Option(help="Writes OUT/FORMAT/SCENE_ID/scene.*")] = Path("exported"),
) -> None:
    """Write scenes for MuJoCo, Isaac Lab and other USD engines, or any viewer of glTF."""
    console, chosen = Console(markup=False, emoji=False), parse_formats(formats)
    if not chosen:
        raise InvalidValueError(f"--format: name at least one of {', '.join(FORMATS)}")
    collection, scenes = find_scenes(scene)
    export_all(collection, scenes, out, chosen, console)


def export_all(
    collection: SceneCollection, scenes: Sequence[Scene], out: Path, formats: Sequence[str], console: Console
) -> None:
    """Write scenes of a collection in some formats, with a bar, and say where they are."""
    if not formats:
        return
    written: tuple[Path, ...] = ()
    for scene in track(scenes, description="exporting", console=console, transient=True):
        written = export_scene(scene, collection.assets_of(scene), out, formats)
    for name, path in zip(formats, written, strict=True):
        what = path if len(scenes) == 1 else f"{len(scenes)} scenes to {out / name}"
        console.print(f"exported {what}", soft_wrap=True)
