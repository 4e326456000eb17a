"""The commands ``clutter6d dataset card`` and ``clutter6d dataset compare``."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Column, Table

from clutter6d.dataset.card import CardOptions, card_file, write_card
from clutter6d.dataset.card_subject import CardSubject, open_subject
from clutter6d.dataset.compare import MeasuredSplit, compare_datasets
from clutter6d.dataset.compare_page import KS_NOTE, TextTable, comparison_page, comparison_tables
from clutter6d.dataset.measurement import measure
from clutter6d.errors import InvalidValueError
from clutter6d.progress import BarsByName, progress_bars
from clutter6d.schema import write_bytes

_SUBJECT_HELP = "A data set's name or folder, a split's name, or a folder of scenes."


def card(
    dataset: Annotated[str, typer.Argument(help=_SUBJECT_HELP)],
    out: Annotated[Path, typer.Option(help="The page, ending in .md, or its folder; pictures go to a folder beside.")],
    scenes: Annotated[int, typer.Option(min=0, help="Scenes on a contact sheet; 0 for no contact sheets.")] = 24,
    assets: Annotated[int, typer.Option(min=1, help="Assets on the contact sheet of a pool.")] = 60,
    backend: Annotated[str, typer.Option(help="auto, egl, osmesa or raycast (needs no OpenGL).")] = "auto",
) -> None:
    """Measure and draw a data set, and write its data card."""
    page, subject = card_file(out), open_subject(dataset)
    console = Console(markup=False, emoji=False)
    options = CardOptions(scenes=scenes, assets=assets, backend=backend)
    with progress_bars(console) as progress:
        bars = BarsByName(progress)
        write_card(subject, page, options, lambda step: bars.update(step.task, step.done, step.total))
    console.print(f"wrote {page} and its pictures in {page.with_suffix('')}", soft_wrap=True)


def compare(
    first: Annotated[str, typer.Argument(help=_SUBJECT_HELP)],
    second: Annotated[str, typer.Argument(help="What it is compared with; likewise.")],
    out: Annotated[Path | None, typer.Option(help="Also write the tables as a Markdown page.")] = None,
    exit_code: Annotated[bool, typer.Option("--exit-code", help="Exit with 1 if the scenes differ.")] = False,
) -> None:
    """Tell two data sets apart: the same figures side by side, distances of distributions, assets in common."""
    if out is not None and out.is_dir():
        raise InvalidValueError(f"--out {out}: is a folder; give the name of a page, for instance {out / 'compare.md'}")
    subjects = open_subject(first), open_subject(second)
    console = Console(markup=False, emoji=False)
    with progress_bars(console) as progress:
        measured = [_measure(subject, number, BarsByName(progress)) for number, subject in enumerate(subjects, start=1)]
    comparison = compare_datasets(*measured)
    tables = comparison_tables(comparison, *_names(*(subject.name for subject in subjects)))
    for table in tables:
        console.print(_rich(table))
    console.print(KS_NOTE if len(tables) > 1 else "the same scenes, bit by bit")
    if out is not None:
        write_bytes(out, comparison_page(tables).encode())
        console.print(f"wrote {out}", soft_wrap=True)
    if exit_code and not comparison.is_identical:
        raise typer.Exit(1)


def _measure(subject: CardSubject, number: int, bars: BarsByName) -> dict[str, MeasuredSplit]:
    measured: dict[str, MeasuredSplit] = {}
    for name, scenes in subject.splits.items():
        task = f"measuring {name} of {subject.name} ({number} of 2)"
        found = measure(scenes, partial(bars.update, task))
        hashes = frozenset(found.objects["asset_hash"])
        measured[name] = MeasuredSplit(sha256=scenes.sha256, asset_hashes=hashes, measured=found)
    return measured


def _names(first: str, second: str) -> tuple[str, str]:
    return (f"{first} (first)", f"{second} (second)") if first == second else (first, second)


def _rich(table: TextTable) -> Table:
    columns = [
        Column(title, overflow="fold", justify="right" if number else "left")
        for number, title in enumerate(table.header)
    ]
    shown = Table(*columns, title=table.title)
    for row in table.rows:
        shown.add_row(*row)
    return shown
