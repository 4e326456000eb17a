"""Measurements as Markdown: printed while they are made, and kept where the documentation includes them."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from machine import describe_machine

MEASURED = Path(__file__).parent / "measured"


class Report:
    """Lines of Markdown under one name, printed as they come.

    Args:
        name: Of the file that keeps them.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._lines: list[str] = []
        self._widths: list[int] = []
        self.say(f"{describe_machine()}.", "")

    def say(self, *lines: str) -> None:
        """Add lines."""
        for line in lines:
            print(line, flush=True)
        self._lines += lines

    def head(self, *columns: str) -> None:
        """Begin a table; the first column is text, the others are figures."""
        self._widths = [max(len(column), 9) for column in columns]
        self._widths[0] = max(len(columns[0]), 44)
        self.say("")
        self._row(columns)
        rules = ["-" * width for width in self._widths]
        self.say("| " + " | ".join([rules[0], *(rule[:-1] + ":" for rule in rules[1:])]) + " |")

    def row(self, *cells: str) -> None:
        """Add a row to the table."""
        self._row(cells)

    def _row(self, cells: Sequence[str]) -> None:
        first, *others = zip(cells, self._widths, strict=True)
        padded = [first[0].ljust(first[1]), *(cell.rjust(width) for cell, width in others)]
        self.say("| " + " | ".join(padded) + " |")

    def keep(self, folder: Path | None) -> None:
        """Write the lines into a folder, if there is one."""
        if folder is not None:
            folder.mkdir(exist_ok=True)
            path = folder / f"{self._name}.md"
            path.write_text("\n".join(self._lines).strip() + "\n")
            print(f"kept in {path}")


def add_record_option(parser: argparse.ArgumentParser) -> None:
    """``--record [FOLDER]``: keep what is printed where the documentation includes it, or elsewhere."""
    parser.add_argument(
        "--record", type=Path, nargs="?", const=MEASURED, help="keep the tables (for the documentation)"
    )
