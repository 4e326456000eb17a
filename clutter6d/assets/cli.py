"""The commands ``clutter6d assets process | list | show | verify``."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from clutter6d.assets.decomposition import MAX_PART_VERTICES, MAX_PARTS, DecompositionSettings
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.mesh_io import MESH_SUFFIXES, MeshLimits
from clutter6d.assets.processing import ProcessingSettings
from clutter6d.assets.report import asset_table, index_table, summary_tables
from clutter6d.assets.run import RunSettings, run, settings_as_stored
from clutter6d.assets.sources.base import AssetSource
from clutter6d.assets.sources.registry import make_source, source_names
from clutter6d.errors import InvalidFileError, InvalidValueError, MissingFileError

app = typer.Typer(no_args_is_help=True, help="Make assets from meshes; list, show and verify them.")

Library = Annotated[Path, typer.Option("--library", "--out", help="Folder of the asset library.")]


@app.command()
def process(
    source: Annotated[str, typer.Argument(help="A source's name, a folder of meshes, or one mesh file.")],
    out: Annotated[Path, typer.Option("--out", "--library", help="The library; an unfinished one is continued.")],
    workers: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 1,
    limit: Annotated[int | None, typer.Option(min=1, help="Process only the first so many objects.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the source, where it has one.")] = None,
    max_size_cm: Annotated[float | None, typer.Option(min=0.1, help="Leave out objects with a longer side.")] = None,
    unit: Annotated[str | None, typer.Option(help="Folder: m, cm, mm, or auto (size unknown; the default).")] = None,
    up: Annotated[str | None, typer.Option(help="Folder: vertical axis of the files, y or z.")] = None,
    licence: Annotated[str | None, typer.Option(help="Folder: under which terms you have the meshes.")] = None,
    author: Annotated[str | None, typer.Option(help="Folder: who made the meshes.")] = None,
    max_vertices: Annotated[int | None, typer.Option(min=4, help="Largest mesh that is read.")] = None,
    max_parts: Annotated[int, typer.Option(min=1, help="Convex parts of an asset.")] = MAX_PARTS,
    max_part_vertices: Annotated[int, typer.Option(min=4, help="Vertices of a part.")] = MAX_PART_VERTICES,
    seconds: Annotated[float, typer.Option(min=1, help="Processor time an object may take, at each effort.")] = 60.0,
    memory_gb: Annotated[float, typer.Option(min=1, help="Memory an object may take.")] = 4.0,
) -> None:
    """Turn the meshes of a source into assets; whatever cannot become one is reported with its reason."""
    console = Console(markup=False, emoji=False)
    given = {"seed": seed, "unit": unit, "up": up, "licence": licence, "author": author}
    chosen = _find_source(source, limit, max_size_cm, max_vertices, {k: v for k, v in given.items() if v is not None})
    decomposition = DecompositionSettings(max_parts=max_parts, max_part_vertices=max_part_vertices)
    settings = ProcessingSettings(decomposition=decomposition)
    items = chosen.objects()[:limit]
    library = AssetLibrary.create(out, settings_as_stored(settings))
    run_settings = RunSettings(workers=workers, seconds=seconds, memory_bytes=int(memory_gb * 2**30))
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    records = []
    with Progress(*columns, console=console) as progress:
        bar = progress.add_task(f"{chosen.name} objects", total=len(items))
        for record in run(chosen, items, library, settings, run_settings):
            records.append(record)
            progress.advance(bar)
    for table in summary_tables(library, records):
        console.print(table)


@app.command("list")
def list_assets(library: Library) -> None:
    """List the assets of a library."""
    Console(markup=False, emoji=False).print(index_table(AssetLibrary.open(library)))


@app.command()
def show(name: Annotated[str, typer.Argument(help="Name or hash of an asset.")], library: Library) -> None:
    """Show what is known of one asset."""
    Console(markup=False, emoji=False).print(asset_table(AssetLibrary.open(library).load(name)))


@app.command()
def verify(library: Library) -> None:
    """Read everything again and compare it with its hash."""
    opened = AssetLibrary.open(library)
    problems = opened.verify()
    console = Console(markup=False, emoji=False)
    for problem in problems:
        console.print(problem, markup=False, highlight=False, soft_wrap=True)
    if problems:
        raise InvalidFileError(library, f"{len(problems)} problems found; process the source again to mend them")
    console.print(f"{len(opened.names())} assets and {len(opened.records())} records verified")


def _find_source(
    source: str, limit: int | None, max_size_cm: float | None, max_vertices: int | None, options: dict[str, Any]
) -> AssetSource:
    """A source by name; or a folder's: of furniture catalogues if it has any, else of meshes."""
    if max_vertices is not None:
        options["limits"] = MeshLimits(max_vertices=max_vertices, max_bytes=max(5_000_000, 100 * max_vertices))
    if max_size_cm is not None:
        options["max_side_m"] = max_size_cm / 100
    path = Path(source)
    if source in source_names():
        if source == "directory":
            raise InvalidValueError("name the folder of meshes itself in place of 'directory'")
        return make_source(source, limit=limit, **options)
    if not path.exists() and not _looks_like_path(source):
        return make_source(source)
    if not path.exists():
        raise MissingFileError("folder of meshes", path)
    if path.is_dir() and any(path.glob("*.sh3f")):
        return make_source("furniture_catalogue", limit=limit, folder=path, **options)
    return make_source("directory", limit=limit, path=path, **options)


def _looks_like_path(source: str) -> bool:
    return any(mark in source for mark in ("/", "\\")) or Path(source).suffix.lower() in MESH_SUFFIXES
