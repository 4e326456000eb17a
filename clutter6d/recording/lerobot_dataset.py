"""A LeRobot data set of format v3.0, joined from episodes: many in one file of frames, and in one video a camera.

What stands where is LeRobot's; extra columns of ``meta/episodes`` name scene, pair and outcome.
"""

import shutil
from collections.abc import Sequence
from itertools import accumulate
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from clutter6d.errors import InvalidFileError
from clutter6d.eval.runner import EpisodeKey
from clutter6d.recording.lerobot_card import card_text, join_licences
from clutter6d.recording.lerobot_features import FPS, IMAGE_PREFIX
from clutter6d.recording.lerobot_meta import (
    DATA_FILE_MB,
    DATA_PATH,
    EPISODES_FILE,
    FILES_PER_CHUNK,
    INFO_FILE,
    VIDEO_FILE_MB,
    VIDEO_PATH,
    Columns,
    EpisodeEntry,
    index_columns,
    write_meta,
)
from clutter6d.recording.recording import RecordingSettings
from clutter6d.recording.rollout_file import join_tables, table_bytes
from clutter6d.render.video import join_videos
from clutter6d.schema import read_model, write_bytes

FRAMES_FILE, EPISODE_FILE, LICENCES_FILE = "frames.parquet", "episode.json", "LICENCES.csv"
README_FILE = "README.md"


def recorded_keys(folder: Path) -> tuple[EpisodeKey, ...]:
    """Scene and pair of the episodes of a finished data set; nothing if there is none.

    Raises:
        InvalidFileError: Its table of episodes is damaged.
    """
    if not (folder / INFO_FILE).is_file():
        return ()
    try:
        table = pq.read_table(folder / EPISODES_FILE, columns=["scene_id", "pair"]).to_pydict()
    except (pa.ArrowException, OSError, ValueError, KeyError) as error:
        problem = " ".join(str(error).split())[:200]
        raise InvalidFileError(folder / EPISODES_FILE, f"not a table of episodes; delete it: {problem}") from None
    return tuple(zip(table["scene_id"], table["pair"], strict=True))


def join_episodes(parts: Sequence[Path], folder: Path, settings: RecordingSettings) -> None:
    """Write a data set of recorded episodes; until that has ended, it cannot be opened.

    Args:
        parts: A folder for each episode, in order.
        folder: The data set's root.
        settings: What was recorded.
    """
    for name in ("meta", "data", "videos"):
        shutil.rmtree(folder / name, ignore_errors=True)
    entries = [read_model(part / EPISODE_FILE, EpisodeEntry, what="recorded episode") for part in parts]
    tasks = list(dict.fromkeys(entry.task for entry in entries))
    files = _join_frames(parts, entries, folder, tasks)
    for camera in settings.cameras:
        files |= _join_videos(parts, entries, folder, camera)
    write_bytes(folder / LICENCES_FILE, join_licences([part / LICENCES_FILE for part in parts]))
    frames = sum(entry.length for entry in entries)
    write_bytes(folder / README_FILE, card_text(settings, len(entries), frames, tasks).encode())
    write_meta(folder, entries, tasks, files, settings)


def _join_frames(parts: Sequence[Path], entries: Sequence[EpisodeEntry], folder: Path, tasks: Sequence[str]) -> Columns:
    """Write the files of frames; returns which file each episode is in."""
    frame = 0
    for index, (part, entry) in enumerate(zip(parts, entries, strict=True)):
        table = pq.read_table(part / FRAMES_FILE)
        for name, values in index_columns(entry, index, frame, tasks).items():
            table = table.append_column(name, pa.array(values)) if name not in table.column_names else table
        write_bytes(part / f"indexed_{FRAMES_FILE}", table_bytes(table))
        frame += entry.length
    paths = [part / f"indexed_{FRAMES_FILE}" for part in parts]
    numbers = number_files([path.stat().st_size for path in paths], DATA_FILE_MB << 20)
    for number in sorted(set(numbers)):
        out = folder / DATA_PATH.format(**_file_index(number))
        out.parent.mkdir(parents=True, exist_ok=True)
        join_tables([path for path, own in zip(paths, numbers, strict=True) if own == number], out, {})
    return _file_columns("data", numbers)


def _join_videos(parts: Sequence[Path], entries: Sequence[EpisodeEntry], folder: Path, camera: str) -> Columns:
    """Write a camera's videos; returns which file each episode is in, from when to when."""
    paths, key = [part / f"{camera}.mp4" for part in parts], IMAGE_PREFIX + camera
    numbers = number_files([path.stat().st_size for path in paths], VIDEO_FILE_MB << 20)
    starts: list[object] = []
    ends: list[object] = []
    for number in sorted(set(numbers)):
        own = [index for index, found in enumerate(numbers) if found == number]
        join_videos([paths[index] for index in own], folder / VIDEO_PATH.format(video_key=key, **_file_index(number)))
        frames = list(accumulate((entries[index].length for index in own), initial=0))
        starts += [frame / FPS for frame in frames[:-1]]
        ends += [frame / FPS for frame in frames[1:]]
    return _file_columns(f"videos/{key}", numbers) | {
        f"videos/{key}/from_timestamp": starts,
        f"videos/{key}/to_timestamp": ends,
    }


def number_files(sizes: Sequence[int], max_bytes: int) -> list[int]:
    """The file of each episode: files are filled one after another up to a size; no episode is parted."""
    numbers: list[int] = []
    number, filled = 0, 0
    for size in sizes:
        if filled and filled + size > max_bytes:
            number, filled = number + 1, 0
        filled += size
        numbers.append(number)
    return numbers


def _file_columns(prefix: str, numbers: Sequence[int]) -> Columns:
    found = [_file_index(number) for number in numbers]
    return {f"{prefix}/{name}": [item[name] for item in found] for name in ("chunk_index", "file_index")}


def _file_index(number: int) -> dict[str, int]:
    chunk, file = divmod(number, FILES_PER_CHUNK)
    return {"chunk_index": chunk, "file_index": file}
