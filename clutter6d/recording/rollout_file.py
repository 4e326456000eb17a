"""Rollouts as two Parquet files: ``steps.parquet``, a row group an episode, and ``episodes.parquet``."""

import contextlib
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
from pydantic import ValidationError

from clutter6d.dataset.parquet import MAX_GROUP_BYTES
from clutter6d.errors import InvalidFileError, MissingFileError, StorageError
from clutter6d.eval.runner import EpisodeKey
from clutter6d.recording.recording import EpisodeParts, RecordingSettings, claim
from clutter6d.recording.rollout import Rollout
from clutter6d.recording.rollout_table import (
    OBJECT_SIZES,
    episode_schema,
    episode_table,
    step_schema,
    step_table,
    to_rollout,
    to_row,
)
from clutter6d.scene import Scene
from clutter6d.schema import canonical_json, write_bytes
from clutter6d.sim.scene_model import SceneModel

STEPS_FILE, EPISODES_FILE, SETTINGS_FILE = "steps.parquet", "episodes.parquet", "recording.json"
METADATA_KEY = b"clutter6d"
SCHEMA_VERSION = 1
MAX_EPISODES = 1_000_000
_HINT = "make some with: clutter6d record --format parquet"


class RolloutRecorder:
    """Writes rollouts as Parquet.

    Args:
        folder: Where they go; continued if it holds an unfinished recording with the same settings.
        settings: What the recording depends on.
        keys: Scene and pair of all episodes, in order.

    Raises:
        InvalidValueError: The folder holds a recording with other settings.
    """

    def __init__(self, folder: Path, settings: RecordingSettings, keys: Sequence[EpisodeKey]) -> None:
        self._folder, self._keys = folder, tuple(keys)
        claim(folder / SETTINGS_FILE, settings)
        header = {"schema_version": SCHEMA_VERSION, "settings": settings.model_dump(mode="json")}
        self._metadata = {METADATA_KEY: canonical_json(header)}
        self._parts = EpisodeParts(folder / ".parts", EPISODES_FILE)
        self._is_complete = _recorded_keys(folder / EPISODES_FILE) == self._keys

    def has(self, key: EpisodeKey) -> bool:
        """Whether an episode is recorded already."""
        return self._is_complete or self._parts.has(key)

    def add(self, rollout: Rollout, scene: Scene, model: SceneModel) -> None:  # noqa: ARG002
        """Record an episode."""
        part = self._parts.path(rollout.row.key)
        write_bytes(part / STEPS_FILE, table_bytes(step_table(rollout)))
        write_bytes(part / EPISODES_FILE, table_bytes(episode_table(rollout)))

    def finish(self) -> Path:
        """Put the two files together; without the episodes' table, which comes last, nothing counts as recorded."""
        if not self._is_complete:
            (self._folder / EPISODES_FILE).unlink(missing_ok=True)
            for name in (STEPS_FILE, EPISODES_FILE):
                join_tables([self._parts.path(key) / name for key in self._keys], self._folder / name, self._metadata)
        self._parts.remove()
        return self._folder


def read_rollouts(path: Path | str) -> Iterator[Rollout]:
    """The rollouts that ``clutter6d record --format parquet`` wrote, one after another.

    Args:
        path: The folder of ``steps.parquet`` and ``episodes.parquet``, or the recording's folder that holds it.

    Returns:
        An iterator that reads an episode when it is asked for.

    Raises:
        MissingFileError: There is no recording.
        InvalidFileError: A file of it is damaged, or of another version.
    """
    folder = Path(path)
    folder = folder if (folder / EPISODES_FILE).is_file() else folder / "rollouts"
    steps, episodes = _open(folder / STEPS_FILE), _open(folder / EPISODES_FILE)
    counts = {steps.num_row_groups, episodes.num_row_groups, episodes.metadata.num_rows}
    if len(counts) != 1 or max(counts) > MAX_EPISODES:
        raise InvalidFileError(folder / STEPS_FILE, f"does not hold the episodes of {EPISODES_FILE}")
    _check_columns(folder, steps, episodes)
    return _read(folder, steps, episodes)


def _read(folder: Path, steps: pq.ParquetFile, episodes: pq.ParquetFile) -> Iterator[Rollout]:
    for group in range(steps.num_row_groups):
        with _blaming(folder / EPISODES_FILE):
            episode = episodes.read_row_group(group).to_pylist()[0]
            steps_said = to_row(episode).steps
        with _blaming(folder / STEPS_FILE):
            rollout = to_rollout(steps.read_row_group(group), episode)
        if len(rollout.actions) != steps_said:
            raise InvalidFileError(folder / STEPS_FILE, f"episode {group} has other steps than {EPISODES_FILE} says")
        yield rollout


def table_bytes(table: pa.Table) -> bytes:
    """A table as it is stored: one row group, compressed, equal bytes for equal content."""
    buffer = io.BytesIO()
    pq.write_table(table, buffer, row_group_size=max(len(table), 1), compression="zstd")
    return buffer.getvalue()


def join_tables(paths: Sequence[Path], out: Path, metadata: Mapping[bytes, bytes]) -> None:
    """Write tables of one schema into one file, a row group each, which replaces the file when it is complete.

    Raises:
        StorageError: The disk is full, or the folder cannot be written.
    """
    partial = out.with_name(f".{out.name}.partial")
    try:
        schema = pq.read_schema(paths[0]).with_metadata(dict(metadata))
        with pq.ParquetWriter(partial, schema, compression="zstd") as writer:
            for path in paths:
                table = pq.read_table(path).replace_schema_metadata(dict(metadata))
                writer.write_table(table, row_group_size=len(table))
        partial.replace(out)
    except OSError as error:
        raise StorageError(f"cannot write {out}: {error.strerror or error}") from None
    finally:
        with contextlib.suppress(OSError):
            partial.unlink()


def _recorded_keys(path: Path) -> tuple[EpisodeKey, ...]:
    """Scene and pair of what is recorded; nothing if there is no such file."""
    if not path.is_file():
        return ()
    with _blaming(path):
        table = _open(path).read(columns=["scene_id", "pair"]).to_pydict()
    return tuple(zip(table["scene_id"], table["pair"], strict=True))


def _open(path: Path) -> pq.ParquetFile:
    if not path.is_file():
        raise MissingFileError("recorded rollouts", path, _HINT)
    with _blaming(path):
        file = pq.ParquetFile(path)
        header = json.loads((file.schema_arrow.metadata or {}).get(METADATA_KEY, b"null"))
        groups = [file.metadata.row_group(group).total_byte_size for group in range(file.num_row_groups)]
    version = header.get("schema_version") if isinstance(header, dict) else None
    if version != SCHEMA_VERSION:
        raise InvalidFileError(path, f"no rollouts of schema version {SCHEMA_VERSION} (found: {version}); {_HINT}")
    if max(groups, default=0) > MAX_GROUP_BYTES:
        raise InvalidFileError(path, f"unpacks to more than {MAX_GROUP_BYTES:,} bytes an episode")
    return file


def _check_columns(folder: Path, steps: pq.ParquetFile, episodes: pq.ParquetFile) -> None:
    found = steps.schema_arrow
    poses = found.field("object_poses").type if "object_poses" in found.names else pa.null()
    objects = poses.list_size // OBJECT_SIZES["object_poses"] if pa.types.is_fixed_size_list(poses) else 0
    clouds = "object_points" in found.names
    expected = {
        STEPS_FILE: (found, step_schema(objects, point_clouds=clouds)),
        EPISODES_FILE: (episodes.schema_arrow, episode_schema(objects, point_clouds=clouds)),
    }
    for name, (schema, wanted) in expected.items():
        if schema.equals(wanted):
            continue
        differing = next((field.name for field in wanted if field not in list(schema)), "of another name")
        raise InvalidFileError(folder / name, f"has other columns than expected: {differing}")


@contextlib.contextmanager
def _blaming(path: Path) -> Iterator[None]:
    try:
        yield
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise InvalidFileError(path, f"not readable as rollouts: {first['loc'][0]}: {first['msg']}") from None
    except (pa.ArrowException, OSError, ValueError, TypeError) as error:
        raise InvalidFileError(path, f"not readable as rollouts: {' '.join(str(error).split())[:200]}") from None
