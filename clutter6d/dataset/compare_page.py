"""A comparison as tables, for the terminal and for a Markdown page alike."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clutter6d.dataset.card_tables import markdown_table
from clutter6d.dataset.compare import Comparison, SplitComparison
from clutter6d.dataset.figures import show


@dataclass(frozen=True, kw_only=True, slots=True)
class TextTable:
    """A table of strings under a title; the first column names the row."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]


def comparison_tables(comparison: Comparison, first: str, second: str) -> tuple[TextTable, ...]:
    """The tables of a comparison.

    Args:
        comparison: What was found.
        first: Name of the first data set.
        second: Name of the second.
    """
    overview = [
        (
            _name(split),
            "the same scenes" if split.is_identical else "different",
            f"{split.first_assets:,}",
            f"{split.second_assets:,}",
            f"{split.shared_assets:,}",
        )
        for split in comparison.splits
    ]
    overview += [(name, f"only in {first}", "", "", "") for name in comparison.only_first]
    overview += [(name, f"only in {second}", "", "", "") for name in comparison.only_second]
    header = ("split", "scenes", f"assets, {first}", f"assets, {second}", "assets in both")
    details = [table for split in comparison.splits if not split.is_identical for table in _details(split)]
    return TextTable(title=f"{first} and {second}", header=header, rows=overview), *details


def comparison_page(tables: Sequence[TextTable]) -> str:
    """The tables as a Markdown page."""
    parts = [f"# {tables[0].title}", markdown_table(tables[0].header, tables[0].rows, text_columns=(0, 1))]
    for table in tables[1:]:
        parts += [f"## {table.title}", markdown_table(table.header, table.rows)]
    return "\n\n".join([*parts, KS_NOTE]) + "\n"


KS_NOTE = (
    "KS is the Kolmogorov-Smirnov distance: the largest difference of the two shares of values up to any one value. It "
    "is 0 for equal distributions and 1 for ones apart. It is no test: the goal pairs of one scene are not independent."
)


def _name(split: SplitComparison) -> str:
    return split.first_name if split.first_name == split.second_name else f"{split.first_name}, {split.second_name}"


def _details(split: SplitComparison) -> tuple[TextTable, TextTable]:
    first, second = split.first_name, split.second_name
    columns = ("first", "second") if first == second else (first, second)
    figures = [
        (
            item.figure.label,
            show(item.first, item.figure.unit),
            show(item.second, item.figure.unit),
            show(item.difference, item.figure.unit, is_difference=True),
        )
        for item in split.figures
    ]
    distances = [
        (
            item.distribution.label,
            "-" if np.isnan(item.distance) else f"{item.distance:.3f}",
            f"{item.first_count:,}",
            f"{item.second_count:,}",
        )
        for item in split.distances
    ]
    return (
        TextTable(title=f"{_name(split)}: figures", header=("", *columns, "difference"), rows=figures),
        TextTable(title=f"{_name(split)}: distributions", header=("", "KS", "n, first", "n, second"), rows=distances),
    )
