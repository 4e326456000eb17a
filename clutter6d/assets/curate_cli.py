"""The command ``clutter6d assets curate``."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from clutter6d.assets.curation import MAX_FACES, CurationSettings, CurationState, curate
from clutter6d.assets.mesh_io import MeshLimits
from clutter6d.assets.sources.objaverse import open_package
from clutter6d.errors import UnknownNameError

_SOURCES = ("objaverse",)


def curate_list(
    source: Annotated[str, typer.Argument(help="Where objects are chosen from: objaverse.")],
    out: Annotated[Path, typer.Option(help="The list, a CSV; an unfinished run is continued.")],
    count: Annotated[int, typer.Option(min=1, help="Objects wanted.")] = 256,
    large_share: Annotated[float, typer.Option(min=0, max=1, help="Share of large ones.")] = 0.5,
    seed: Annotated[int, typer.Option(help="Another seed looks at the objects in another order.")] = 0,
    licence: Annotated[
        list[str] | None, typer.Option(help="Licence that passes, for instance by-nc; may be given again. [cc0, by]")
    ] = None,
    category: Annotated[
        list[str] | None, typer.Option(help="LVIS category; may be given again. [things of a table-top]")
    ] = None,
    max_vertices: Annotated[int, typer.Option(min=4, help="Largest mesh.")] = MeshLimits().max_vertices,
    max_faces: Annotated[int, typer.Option(min=4, help="Largest mesh.")] = MAX_FACES,
    max_mb: Annotated[float, typer.Option(min=0.001, help="Largest file.")] = MeshLimits().max_bytes / 1e6,
) -> None:
    """Choose objects by licence, size and category from annotations alone, and list them with their attribution."""
    if source not in _SOURCES:
        raise UnknownNameError("source to choose from", source, _SOURCES)
    settings = CurationSettings(
        count=count,
        large_share=large_share,
        seed=seed,
        licences=tuple(licence) if licence else CurationSettings().licences,
        categories=tuple(category) if category else None,
        limits=MeshLimits(max_vertices=max_vertices, max_bytes=round(max_mb * 1e6)),
        max_faces=max_faces,
    )
    console = Console(markup=False, emoji=False)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    state: CurationState | None = None
    with Progress(*columns, console=console) as progress:
        looked, chosen = progress.add_task("objects looked at", total=None), progress.add_task("chosen", total=count)
        for state in curate(open_package(), settings, out):
            progress.update(looked, completed=state.judged, total=state.candidates)
            progress.update(chosen, completed=len(state.chosen))
    if state is not None:
        _print(state, settings, out, console)


def _print(state: CurationState, settings: CurationSettings, out: Path, console: Console) -> None:
    table = Table("not chosen because", "objects")
    for reason, number in sorted(state.refused.items(), key=lambda item: -item[1]):
        table.add_row(reason, f"{number:,}")
    console.print(table)
    sizes = [f"{size}: {sum(item.size_class == size for item in state.chosen)}" for size in settings.quotas]
    console.print(f"{len(state.chosen)} objects ({', '.join(sizes)}) listed in {out}", soft_wrap=True)
    if len(state.chosen) < settings.count:
        console.print(f"{settings.count} were wanted; allow more licences, categories or larger meshes")
    console.print(f"next: clutter6d assets process {_SOURCES[0]} --list {out} --out LIBRARY", soft_wrap=True)
