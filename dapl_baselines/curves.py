"""A training's curves, as CSV files and for TensorBoard; a continued training cuts off the rows that it makes again."""

import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from clutter6d.errors import InvalidFileError, MissingDependencyError
from clutter6d.schema import read_bytes, write_bytes

TENSORBOARD_FOLDER: Final = "tensorboard"


class Curves:
    """The curves in a folder: ``NAME.csv`` each, and all in ``tensorboard/``.

    Args:
        folder: The folder.
        last: What was counted before: the last iteration or step that need not be made again.
        counted: What is counted, the first column.

    Raises:
        MissingDependencyError: TensorBoard is not installed.
    """

    def __init__(self, folder: Path, last: int, *, counted: str = "iteration") -> None:
        self._folder, self._last, self._counted = folder, last, counted
        self._scalars = _open_tensorboard(folder / TENSORBOARD_FOLDER, last)
        self._begun: set[str] = set()

    def add(self, name: str, number: int, values: Mapping[str, float]) -> None:
        """Add a point to a curve.

        Raises:
            InvalidFileError: The file in its place is not a curve.
        """
        path, row = self._folder / f"{name}.csv", {self._counted: number, **values}
        if name not in self._begun:
            self._begun.add(name)
            _cut(path, self._last, list(row))
        with path.open("a", newline="") as file:
            csv.DictWriter(file, list(row), lineterminator="\n").writerow(row)
        for key, value in values.items():
            if math.isfinite(value):
                self._scalars.add_scalar(f"{name}/{key}", value, number)

    def close(self) -> None:
        """Write what is not yet written."""
        self._scalars.close()


def _cut(path: Path, last: int, columns: list[str]) -> None:
    """Leave the rows up to the last iteration, or begin the file; a line without an end was cut by a kill."""
    header = ",".join(columns) + "\n"
    text = read_bytes(path, what="curve").decode(errors="replace") if path.is_file() else header
    first, *rows = [line for line in text.splitlines(keepends=True) if line.endswith("\n")] or [""]
    numbers = [row.partition(",")[0] for row in rows]
    if first != header or not all(number.isdecimal() for number in numbers):
        raise InvalidFileError(path, "not a curve of this training; move it away")
    kept = [row for row, number in zip(rows, numbers, strict=True) if int(number) <= last]
    write_bytes(path, "".join([header, *kept]).encode())


def _open_tensorboard(folder: Path, last: int) -> Any:
    """A writer that hides what was written after the last number."""
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        raise MissingDependencyError("training curves need TensorBoard: pip install tensorboard") from None
    return SummaryWriter(str(folder), purge_step=last + 1)
