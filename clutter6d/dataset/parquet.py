"""Parquet files at the package's edge: written atomically with equal bytes for equal content, read with suspicion."""

import io
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from clutter6d.errors import InvalidFileError
from clutter6d.schema import read_bytes, write_bytes

MAX_FILE_BYTES = 512 << 20
MAX_GROUP_BYTES = 256 << 20


def write_parquet(path: Path, table: pa.Table, *, rows_per_group: int) -> None:
    """Write one table, compressed; its rows can be read a group at a time.

    Raises:
        StorageError: The disk is full, or the folder cannot be written.
    """
    buffer = io.BytesIO()
    pq.write_table(
        table,
        buffer,
        row_group_size=rows_per_group,
        compression="zstd",
        compression_level=15,
        use_dictionary=False,
        use_byte_stream_split=False,
    )
    write_bytes(path, buffer.getvalue())


class ParquetRows:
    """A Parquet file of a known schema whose row groups are read when they are needed.

    Args:
        path: The file.
        schema: What its columns must be.
        what: Name of the kind of file, for messages.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is no Parquet file of this schema, or is too large.
    """

    def __init__(self, path: Path, schema: pa.Schema, *, what: str) -> None:
        self._path, self._what = path, what
        self.content = read_bytes(path, what=what, max_bytes=MAX_FILE_BYTES)
        try:
            self._file = pq.ParquetFile(io.BytesIO(self.content))
            found = self._file.schema_arrow
            groups = [self._file.metadata.row_group(group) for group in range(self._file.num_row_groups)]
        except (pa.ArrowException, OSError, ValueError) as error:
            raise self._invalid(error) from None
        if not found.equals(schema):
            differing = next((name for name in schema.names if name not in found.names), None)
            problem = f"column '{differing}' is missing" if differing else "its columns are not those of the schema"
            raise InvalidFileError(path, f"not a valid {what}: {problem}")
        if any(group.total_byte_size > MAX_GROUP_BYTES for group in groups):
            raise InvalidFileError(path, f"unpacks to more than {MAX_GROUP_BYTES:,} bytes a row group")
        self._starts = [0]
        for group in groups:
            self._starts.append(self._starts[-1] + group.num_rows)
        self._groups: dict[int, pa.Table] = {}

    def __len__(self) -> int:
        """Number of rows."""
        return self._starts[-1]

    def columns(self, *names: str) -> dict[str, list[object]]:
        """Whole columns as lists; meant for small ones."""
        return self._read(lambda: self._file.read(columns=list(names))).to_pydict()

    def row(self, index: int) -> pa.Table:
        """One row, as a table of one row."""
        group = next(number for number, end in enumerate(self._starts[1:]) if index < end)
        if group not in self._groups:
            self._groups[group] = self._read(lambda: self._file.read_row_group(group))
        return self._groups[group].slice(index - self._starts[group], 1)

    def _read(self, read: Callable[[], pa.Table]) -> pa.Table:
        try:
            return read()
        except (pa.ArrowException, OSError, ValueError) as error:
            raise self._invalid(error) from None

    def _invalid(self, error: BaseException) -> InvalidFileError:
        return InvalidFileError(self._path, f"not a valid {self._what}: {' '.join(str(error).split())[:200]}")
