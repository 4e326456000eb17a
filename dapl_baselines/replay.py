"""The last rows that a training learns from, in files: more than memory should hold or a state repeat.

The rows are written before the training's state is. A training that is killed in between makes the same rows again in
the same places, so nothing is lost and nothing is kept twice.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

import numpy as np
import torch
from jaxtyping import Int
from torch import Tensor

from clutter6d.errors import InvalidFileError, StorageError

_DTYPES: Final = {torch.float32: np.dtype("<f4"), torch.float16: np.dtype("<f2"), torch.int32: np.dtype("<i4")}


class Replay:
    """A ring of rows: the newest take the place of the oldest. Rows are numbered from the first that was ever added.

    Args:
        folder: Where its files are, one for each field.
        like: One batch of rows, for the fields' sizes and types.
        rows: How many are kept.

    Attributes:
        count: Rows ever added.

    Raises:
        InvalidFileError: A file in the folder is damaged or of another training.
        StorageError: The disk is full, or the folder cannot be written.
    """

    def __init__(self, folder: Path, like: Mapping[str, Tensor], rows: int) -> None:
        self.count, self._rows = 0, rows
        self._fields = {
            name: _open(folder / f"{name}.npy", (rows, *batch.shape[1:]), _DTYPES[batch.dtype])
            for name, batch in like.items()
        }

    @property
    def fields(self) -> tuple[str, ...]:
        """What there is of a row."""
        return tuple(self._fields)

    @property
    def oldest(self) -> int:
        """Number of the oldest row that is still there."""
        return self.oldest_of(self.count)

    def oldest_of(self, count: int) -> int:
        """Number of the oldest row that is there when so many have been added."""
        return max(0, count - self._rows)

    def add(self, batch: Mapping[str, Tensor]) -> None:
        """Add rows; all fields have as many."""
        added = len(next(iter(batch.values())))
        places = np.arange(self.count, self.count + added) % self._rows
        for name, values in batch.items():
            self._fields[name][places] = values.numpy()
        self.count += added

    def take(self, numbers: Int[np.ndarray, "*row"], fields: Iterable[str]) -> dict[str, Tensor]:
        """Some rows, a copy.

        Args:
            numbers: Of rows that are still there.
            fields: What of them is wanted.
        """
        places = numbers % self._rows
        return {name: torch.from_numpy(np.asarray(self._fields[name][places])) for name in fields}

    def put(self, field: str, numbers: Int[np.ndarray, "row"], values: np.ndarray) -> None:
        """Change one field of rows that are still there."""
        self._fields[field][numbers % self._rows] = values

    def flush(self) -> None:
        """Bring the rows to the disk, which only a loss of power needs; a kill does not."""
        for field in self._fields.values():
            field.flush()


def _open(path: Path, shape: tuple[int, ...], dtype: np.dtype) -> np.memmap:
    if not path.is_file():
        _allocate(path, shape, dtype)
    try:
        field = np.load(path, mmap_mode="r+", allow_pickle=False)
    except (ValueError, OSError, EOFError) as error:
        raise InvalidFileError(path, f"not rows of a training: {error}") from None
    if not isinstance(field, np.memmap) or field.shape != shape or field.dtype != dtype:
        raise InvalidFileError(path, f"not the rows of this training, which are {dtype}{shape}; choose another --out")
    return field


def _allocate(path: Path, shape: tuple[int, ...], dtype: np.dtype) -> None:
    """An empty file with all its bytes, so that no disk is full while rows are written."""
    unfinished = path.with_suffix(".new.npy")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(unfinished, np.zeros(shape, dtype=dtype))
        unfinished.replace(path)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise StorageError(f"cannot write {path}: {error.strerror}; nothing earlier was changed") from None
