"""The commands ``clutter6d assets process | curate | list | show | verify | annotate | review | reviews``."""

import contextlib
import getpass
import threading
import webbrowser
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import track

from clutter6d.assets.annotation.annotator import VIEW_ANGLES_DEG, VIEW_SIDE_PX, Annotator
from clutter6d.assets.annotation.endpoint import Endpoint
from clutter6d.assets.annotation.endpoint_settings import MODEL_VARIABLE, URL_VARIABLE, settings_from_environment
from clutter6d.assets.annotation.memory import FOLDER as ANSWERS_FOLDER
from clutter6d.assets.annotation.memory import AnswerMemory
from clutter6d.assets.annotation.plan import ANNOTATORS, AnnotationSettings, names_to_annotate, replaceable_origins
from clutter6d.assets.annotation.report import Prices, annotation_tables
from clutter6d.assets.annotation.rule import RuleAnnotator
from clutter6d.assets.annotation.run import Outcome, annotate_library
from clutter6d.assets.annotation.vlm import VlmAnnotator
from clutter6d.assets.asset import Asset
from clutter6d.assets.curate_cli import curate_list
from clutter6d.assets.decomposition import MAX_PART_VERTICES, MAX_PARTS, DecompositionSettings
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.mesh_io import MESH_SUFFIXES, MeshLimits
from clutter6d.assets.processing import ProcessingSettings
from clutter6d.assets.report import asset_table, index_table, summary_tables
from clutter6d.assets.review.summary import decisions_csv, review_tables
from clutter6d.assets.run import RunSettings, run, settings_as_stored
from clutter6d.assets.sources.base import AssetSource
from clutter6d.assets.sources.registry import make_source, source_names
from clutter6d.errors import InvalidFileError, InvalidValueError, MissingFileError, UnknownNameError
from clutter6d.executor import EXECUTOR_HELP, parse_executor
from clutter6d.progress import progress_bars
from clutter6d.render.asset_picture import asset_views
from clutter6d.render.backend import choose_backend
from clutter6d.render.sheet import png_of
from clutter6d.schema import write_bytes

app = typer.Typer(no_args_is_help=True, help="Make assets from meshes; annotate, review, list and verify them.")

Library = Annotated[Path, typer.Option("--library", "--out", help="Folder of the asset library.")]

app.command("curate")(curate_list)


@app.command()
def process(
    source: Annotated[str, typer.Argument(help="A source's name, a folder of meshes, or one mesh file.")],
    out: Annotated[Path, typer.Option("--out", "--library", help="The library; an unfinished one is continued.")],
    workers: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 1,
    executor: Annotated[str, typer.Option(help=EXECUTOR_HELP)] = "local",
    limit: Annotated[int | None, typer.Option(min=1, help="Process only the first so many objects.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the source, where it has one.")] = None,
    max_size_cm: Annotated[float | None, typer.Option(min=0.1, help="Leave out objects with a longer side.")] = None,
    unit: Annotated[str | None, typer.Option(help="Folder: m, cm, mm, or auto (size unknown; the default).")] = None,
    up: Annotated[str | None, typer.Option(help="Folder: vertical axis of the files, y or z.")] = None,
    licence: Annotated[str | None, typer.Option(help="Folder: under which terms you have the meshes.")] = None,
    author: Annotated[str | None, typer.Option(help="Folder: who made the meshes.")] = None,
    list_file: Annotated[Path | None, typer.Option("--list", help="Objaverse: a list made by curate.")] = None,
    max_vertices: Annotated[int | None, typer.Option(min=4, help="Largest mesh that is read.")] = None,
    max_parts: Annotated[int, typer.Option(min=1, help="Convex parts of an asset.")] = MAX_PARTS,
    max_part_vertices: Annotated[int, typer.Option(min=4, help="Vertices of a part.")] = MAX_PART_VERTICES,
    seconds: Annotated[float, typer.Option(min=1, help="Processor time an object may take, at each effort.")] = 60.0,
    memory_gb: Annotated[float, typer.Option(min=1, help="Memory an object may take.")] = 4.0,
) -> None:
    """Turn the meshes of a source into assets; whatever cannot become one is reported with its reason."""
    console, where = Console(markup=False, emoji=False), parse_executor(executor)
    given = {"seed": seed, "unit": unit, "up": up, "licence": licence, "author": author, "list_file": list_file}
    chosen = find_source(source, limit, max_size_cm, max_vertices, {k: v for k, v in given.items() if v is not None})
    decomposition = DecompositionSettings(max_parts=max_parts, max_part_vertices=max_part_vertices)
    settings = ProcessingSettings(decomposition=decomposition)
    items = chosen.objects()[:limit]
    library = AssetLibrary.create(out, settings_as_stored(settings))
    run_settings = RunSettings(workers=workers, executor=where, seconds=seconds, memory_bytes=int(memory_gb * 2**30))
    records = []
    with progress_bars(console) as progress:
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
    console.print(f"{len(opened.names(with_rejected=True))} assets and {len(opened.records())} records verified")


@app.command()
def annotate(
    library: Annotated[Path, typer.Argument(help="Folder of the asset library.")],
    by: Annotated[str, typer.Option(help="rule (offline), or vlm (asks a vision-language model).")] = "rule",
    model: Annotated[str | None, typer.Option(help=f"vlm: the model's name; by default ${MODEL_VARIABLE}.")] = None,
    base_url: Annotated[str | None, typer.Option(help=f"vlm: where it is; by default ${URL_VARIABLE}.")] = None,
    limit: Annotated[int | None, typer.Option(min=1, help="Annotate only the first so many assets.")] = None,
    concurrency: Annotated[int, typer.Option(min=1, max=64, help="Questions asked at the same time.")] = 4,
    overwrite: Annotated[
        list[str] | None, typer.Option(help="Also replace values of this origin: source, declared, vlm or person.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show what would change; ask nobody, write nothing.")
    ] = False,
    timeout: Annotated[float, typer.Option(min=0.1, help="vlm: seconds to wait for an answer.")] = 120.0,
    retries: Annotated[int, typer.Option(min=0, help="vlm: further tries where the endpoint is busy or silent.")] = 5,
    price_in: Annotated[float | None, typer.Option(min=0, help="vlm: price of a million input tokens.")] = None,
    price_out: Annotated[float | None, typer.Option(min=0, help="vlm: price of a million output tokens.")] = None,
    backend: Annotated[str, typer.Option(help="vlm: what draws the views: auto, egl, osmesa or raycast.")] = "auto",
) -> None:
    """Fill in category, colour, material, mass and friction, each with its origin; a person's values stay."""
    opened, console = AssetLibrary.open(library), Console(markup=False, emoji=False)
    settings = AnnotationSettings(
        overwrite=replaceable_origins(overwrite or ()), concurrency=concurrency, limit=limit, is_dry_run=dry_run
    )
    if by not in ANNOTATORS:
        raise UnknownNameError("annotator", by, ANNOTATORS)
    annotator: Annotator = RuleAnnotator()
    if by == "vlm":
        endpoint = settings_from_environment(model=model, base_url=base_url, timeout_s=timeout, retries=retries)
        annotator = VlmAnnotator(Endpoint(endpoint), AnswerMemory(library / ANSWERS_FOLDER, endpoint.model))
        backend = choose_backend(backend)
        console.print(f"asking {endpoint.model} at {endpoint.shown_url}", soft_wrap=True, highlight=False)
    names = names_to_annotate(opened, settings)
    outcomes: list[Outcome] = []
    try:
        annotating = annotate_library(opened, names, annotator, partial(_views, backend=backend), settings)
        for outcome in track(annotating, "annotating", total=len(names), console=console, transient=True):
            outcomes.append(outcome)
    finally:
        prices = Prices(input_per_million=price_in, output_per_million=price_out)
        if dry_run:
            console.print("dry run: nobody is asked and nothing is written; this is what would happen")
        for table in annotation_tables(outcomes, len(opened.names()) - len(names), prices):
            console.print(table)


def _views(asset: Asset, *, backend: str) -> tuple[bytes, ...]:
    """What an annotator is shown of an asset."""
    return tuple(png_of(view) for view in asset_views(asset, VIEW_ANGLES_DEG, size_px=VIEW_SIDE_PX, backend=backend))


@app.command()
def review(
    library: Annotated[Path, typer.Argument(help="Folder of the asset library.")],
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on this machine; 0 for any free one.")] = 0,
    reviewer: Annotated[str, typer.Option(help="Who decides; you, if not given.")] = "",
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the page's address.")] = False,
) -> None:
    """Look at each asset in the browser; accept, edit or reject it. Every decision is saved at once."""
    from clutter6d.assets.review.server import ReviewServer
    from clutter6d.assets.review.session import ReviewSession

    session = ReviewSession(AssetLibrary.open(library), reviewer or _user_name())
    console = Console(markup=False, emoji=False, soft_wrap=True, highlight=False)
    with ReviewServer(session, port) as server:
        console.print(f"review page: {server.url}")
        console.print(f"decisions of {session.reviewer} go to {library / 'reviews.jsonl'}; stop with Ctrl+C")
        if not no_browser:
            threading.Thread(target=webbrowser.open, args=(server.url,), daemon=True).start()
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()
    for table in review_tables(AssetLibrary.open(library)):
        console.print(table)


@app.command()
def reviews(
    library: Annotated[Path, typer.Argument(help="Folder of the asset library.")],
    csv: Annotated[Path | None, typer.Option(help="Write every decision to this file, too.")] = None,
) -> None:
    """Show what reviewers decided."""
    opened, console = AssetLibrary.open(library), Console(markup=False, emoji=False)
    for table in review_tables(opened):
        console.print(table)
    if csv is not None:
        write_bytes(csv, decisions_csv(opened))
        console.print(f"every decision is in {csv}", soft_wrap=True, highlight=False)


def _user_name() -> str:
    """Who is logged in."""
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        raise InvalidValueError("nobody is logged in; say who decides with --reviewer NAME") from None


def find_source(
    source: str,
    limit: int | None = None,
    max_size_cm: float | None = None,
    max_vertices: int | None = None,
    given: Mapping[str, Any] | None = None,
) -> AssetSource:
    """A source by name; or a folder's: of furniture catalogues if it has any, else of meshes."""
    options = dict(given or {})
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
