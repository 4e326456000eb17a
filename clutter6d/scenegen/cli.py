"""The command ``clutter6d generate``."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Column, Table

from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.named_libraries import open_library
from clutter6d.dataset.figures import FIGURES, show
from clutter6d.dataset.measurement import measure
from clutter6d.executor import EXECUTOR_HELP, Executor, parse_executor
from clutter6d.export.cli import FORMATS_HELP, export_all
from clutter6d.export.formats import parse_formats
from clutter6d.progress import progress_bars
from clutter6d.scenegen.generation import generate_scenes, has_scene, open_for_generation
from clutter6d.scenegen.scene_set import SceneSet
from clutter6d.scenegen.track import find_track


def generate(
    track: Annotated[str, typer.Option(help="sparse (4 objects), moderate (8) or dense (12).")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the scenes, scenes/TRACK by default; an unfinished one is continued.")
    ] = None,
    scenes: Annotated[int, typer.Option(min=1, help="Number of scenes.")] = 16,
    first: Annotated[int, typer.Option(min=0, help="Index of the first scene.")] = 0,
    seed: Annotated[int, typer.Option(help="Scene i of a seed is always the same scene.")] = 0,
    library: Annotated[str, typer.Option(help="A source's name, or the folder of an asset library.")] = "procedural",
    workers: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 1,
    executor: Annotated[str, typer.Option(help=EXECUTOR_HELP)] = "local",
    export: Annotated[str, typer.Option(help=FORMATS_HELP)] = "",
) -> None:
    """Generate certified scenes with 16 goal pairs each."""
    console = Console(markup=False, emoji=False)
    formats, where = parse_formats(export), parse_executor(executor)
    chosen, indices = find_track(track), range(first, first + scenes)
    out = out or Path("scenes") / chosen.name
    with progress_bars(console) as progress:
        assets = _open_library(library, workers, where, progress)
        scene_set = open_for_generation(assets, chosen, seed, out)
        done = sum(has_scene(scene_set, chosen, seed, index) for index in indices)
        bar = progress.add_task(f"{track} scenes", total=scenes, completed=done)
        for _ in generate_scenes(assets, chosen, seed, scene_set, indices, workers=workers, executor=where):
            progress.advance(bar)
    scene_set = SceneSet.open(out)
    _print_summary(scene_set, console)
    export_all(scene_set, scene_set.scenes, out, formats, console)


def _open_library(library: str, workers: int, executor: Executor, progress: Progress) -> AssetLibrary:
    """Open a library; the built-in one is made on first use, with a bar of its own."""
    bar = progress.add_task("built-in objects (once)", total=None, visible=False)
    return open_library(
        library,
        workers=workers,
        executor=executor,
        on_progress=lambda done, total: progress.update(bar, completed=done, total=total, visible=True),
    )


def _print_summary(scene_set: SceneSet, console: Console) -> None:
    measured = measure(scene_set)
    title = f"{len(measured.scenes)} scenes in {scene_set.path}"
    table = Table("", Column(overflow="fold"), show_header=False, title=title)
    table.add_row("goal pairs", f"{len(measured.pairs):,}")
    for figure in FIGURES:
        table.add_row(figure.label, show(figure.read(measured), figure.unit))
    failures = ", ".join(f"{reason} {count}" for reason, count in scene_set.failures().most_common())
    table.add_row("failed draws by reason", failures or "none")
    table.add_row("scene set SHA-256", scene_set.sha256)
    console.print(table)
