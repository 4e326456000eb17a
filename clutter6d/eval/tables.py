"""The tables of an evaluation as Parquet files, written atomically and read with suspicion."""

import io
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from jaxtyping import Float32
from pydantic import ValidationError

from clutter6d.envs.action import ACTION_SIZE
from clutter6d.errors import InvalidFileError
from clutter6d.eval.episode import EpisodeRecord, EpisodeRow
from clutter6d.schema import read_bytes, write_bytes

EPISODES_FILE, ACTIONS_FILE = "episodes.parquet", "actions.parquet"
ACTION_COLUMNS = tuple(f"action_{joint}" for joint in range(1, ACTION_SIZE + 1))
MAX_TABLE_BYTES = 256 << 20
MAX_ROWS = 5_000_000


def write_rows(folder: Path, rows: Sequence[EpisodeRow]) -> None:
    """Write ``episodes.parquet``: one row an episode."""
    _write(folder / EPISODES_FILE, pd.DataFrame([row.model_dump() for row in rows]))


def write_actions(folder: Path, records: Sequence[EpisodeRecord]) -> None:
    """Write ``actions.parquet``: one row a control step, the residuals [rad] as float32."""
    lengths = [len(record.actions) for record in records]
    columns: dict[str, object] = {
        "scene_id": np.repeat([record.row.scene_id for record in records], lengths),
        "pair": np.repeat([record.row.pair for record in records], lengths),
        "step": np.concatenate([np.arange(length) for length in lengths]),
    }
    actions = np.concatenate([record.actions for record in records])
    columns |= {name: actions[:, index] for index, name in enumerate(ACTION_COLUMNS)}
    _write(folder / ACTIONS_FILE, pd.DataFrame(columns))


def read_rows(folder: Path) -> tuple[EpisodeRow, ...]:
    """Read ``episodes.parquet``.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is no such table.
    """
    path = folder / EPISODES_FILE
    table = _read(path, tuple(EpisodeRow.model_fields))
    try:
        rows = tuple(EpisodeRow.model_validate(row) for row in table.to_pylist())
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise InvalidFileError(path, f"not a table of episodes: {first['loc'][0]}: {first['msg']}") from None
    (scene_id, pair), count = Counter(row.key for row in rows).most_common(1)[0] if rows else (("", 0), 0)
    if count > 1:
        raise InvalidFileError(path, f"not a table of episodes: {scene_id} pair {pair} is in it {count} times")
    return rows


def read_actions(folder: Path) -> dict[tuple[str, int], Float32[np.ndarray, "step 7"]]:
    """Read ``actions.parquet``: the actions of every episode by scene and pair.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is no such table, or steps are missing, or an action is not finite.
    """
    path = folder / ACTIONS_FILE
    table = _read(path, ("scene_id", "pair", "step", *ACTION_COLUMNS))
    if not all(pa.types.is_integer(table.schema.field(name).type) for name in ("pair", "step")):
        raise InvalidFileError(path, "not a table of actions: pair and step are not whole numbers")
    if any(table.schema.field(name).type != pa.float32() for name in ACTION_COLUMNS):
        raise InvalidFileError(path, "not a table of actions: the actions are not float32")
    frame = table.to_pandas()
    if not np.isfinite(frame[list(ACTION_COLUMNS)].to_numpy()).all():
        raise InvalidFileError(path, "not a table of actions: an action is not finite")
    found: dict[tuple[str, int], np.ndarray] = {}
    for (scene_id, pair), rows in frame.groupby(["scene_id", "pair"], sort=True):
        if not np.array_equal(rows["step"].to_numpy(), np.arange(len(rows))):
            raise InvalidFileError(
                path, f"not a table of actions: steps of {scene_id} pair {pair} are not 0, 1, 2, ..."
            )
        found[str(scene_id), int(pair)] = rows[list(ACTION_COLUMNS)].to_numpy(dtype=np.float32)
    return found


def _write(path: Path, frame: pd.DataFrame) -> None:
    buffer = io.BytesIO()
    frame.to_parquet(buffer, index=False)
    write_bytes(path, buffer.getvalue())


def _read(path: Path, columns: Sequence[str]) -> pa.Table:
    content = read_bytes(path, what="evaluation table", max_bytes=MAX_TABLE_BYTES)
    try:
        file = pq.ParquetFile(io.BytesIO(content))
        if file.metadata.num_rows > MAX_ROWS:
            raise InvalidFileError(path, f"has {file.metadata.num_rows:,} rows, more than the {MAX_ROWS:,} allowed")
        if set(file.schema_arrow.names) != set(columns):
            differing = sorted(set(file.schema_arrow.names) ^ set(columns))
            raise InvalidFileError(path, f"has other columns than expected: {differing[0]}")
        return file.read()
    except (pa.ArrowException, OSError, ValueError) as error:
        raise InvalidFileError(path, f"not a Parquet table: {' '.join(str(error).split())[:200]}") from None
