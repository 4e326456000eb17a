"""The ``meta`` folder of a LeRobot data set, and what is kept of an episode until it is written."""

import io
import json
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
import pyarrow as pa
from jaxtyping import Int64
from pydantic import Field

from clutter6d.recording.lerobot_features import FPS, IMAGE_PREFIX, make_features
from clutter6d.recording.lerobot_stats import FeatureStats, array_stats, join_stats, to_lists
from clutter6d.recording.recording import RecordingSettings
from clutter6d.recording.rollout_file import table_bytes
from clutter6d.schema import FileModel, write_bytes

INFO_FILE, STATS_FILE, TASKS_FILE = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
EPISODES_FILE = "meta/episodes/chunk-000/file-000.parquet"
_NUMBERED = "chunk-{chunk_index:03d}/file-{file_index:03d}"
DATA_PATH, VIDEO_PATH = f"data/{_NUMBERED}.parquet", f"videos/{{video_key}}/{_NUMBERED}.mp4"
FILES_PER_CHUNK = 1000
DATA_FILE_MB, VIDEO_FILE_MB = 100, 200
ROBOT_TYPE = "panda"


class EpisodeEntry(FileModel):
    """What is kept of an episode beside frames and videos, until all are joined.

    Attributes:
        scene_id: The scene.
        pair: Index of the goal pair.
        outcome: How it ended.
        task: What was to be done, as a sentence.
        length: Frames.
        objects: Objects in the scene.
        stats: Statistics by feature.
    """

    schema_version: Literal[1] = 1
    scene_id: str
    pair: int = Field(ge=0)
    outcome: str
    task: str
    length: int = Field(ge=1)
    objects: int = Field(ge=1)
    stats: dict[str, FeatureStats]


Columns = dict[str, list[object]]


def write_meta(
    folder: Path, entries: Sequence[EpisodeEntry], tasks: Sequence[str], files: Columns, settings: RecordingSettings
) -> None:
    """Write all of ``meta``; ``info.json``, without which the data set cannot be opened, comes last.

    Args:
        folder: The data set's root.
        entries: The episodes.
        tasks: Their tasks, each once.
        files: Columns that tell in which files an episode is.
        settings: What was recorded.
    """
    stops = np.cumsum([0, *(entry.length for entry in entries)]).tolist()
    columns: Columns = {
        "episode_index": list(range(len(entries))),
        "tasks": [[entry.task] for entry in entries],
        "length": [entry.length for entry in entries],
        "dataset_from_index": stops[:-1],
        "dataset_to_index": stops[1:],
        **{name: [getattr(entry, name) for entry in entries] for name in ("scene_id", "pair", "outcome")},
        **{f"meta/episodes/{name}": [0] * len(entries) for name in ("chunk_index", "file_index")},
    }
    stats = [_all_stats(entry, index, stops[index], tasks) for index, entry in enumerate(entries)]
    write_bytes(folder / EPISODES_FILE, table_bytes(pa.table(columns | files | _stats_columns(stats))))
    joined = {name: join_stats([episode[name] for episode in stats]) for name in stats[0]}
    lists = {name: to_lists(values, is_picture=_is_picture(name)) for name, values in joined.items()}
    write_bytes(folder / STATS_FILE, _json(lists))
    buffer = io.BytesIO()
    pd.DataFrame({"task_index": range(len(tasks))}, index=list(tasks)).to_parquet(buffer)
    write_bytes(folder / TASKS_FILE, buffer.getvalue())
    write_bytes(folder / INFO_FILE, _json(_info(entries, tasks, settings)))


def index_columns(
    entry: EpisodeEntry, episode: int, first: int, tasks: Sequence[str]
) -> dict[str, Int64[np.ndarray, "frame"]]:
    """What tells an episode's frames apart from those of the others.

    Args:
        entry: The episode.
        episode: Its index.
        first: Index of its first frame among all frames.
        tasks: The tasks, each once.
    """
    return {
        "episode_index": np.full(entry.length, episode),
        "index": np.arange(first, first + entry.length),
        "task_index": np.full(entry.length, tasks.index(entry.task)),
    }


def _all_stats(entry: EpisodeEntry, episode: int, first: int, tasks: Sequence[str]) -> dict[str, FeatureStats]:
    added = index_columns(entry, episode, first, tasks)
    return entry.stats | {name: array_stats(values) for name, values in added.items()}


def _stats_columns(stats: Sequence[dict[str, FeatureStats]]) -> Columns:
    columns = defaultdict[str, list[object]](list)
    for episode in stats:
        for feature, values in episode.items():
            for name, numbers in to_lists(values, is_picture=_is_picture(feature)).items():
                columns[f"stats/{feature}/{name}"].append(numbers)
    return dict(columns)


def _info(entries: Sequence[EpisodeEntry], tasks: Sequence[str], settings: RecordingSettings) -> dict[str, object]:
    features = make_features(
        entries[0].objects,
        cameras=settings.cameras,
        width=settings.width,
        height=settings.height,
        point_clouds=settings.point_clouds,
    )
    return {
        "codebase_version": "v3.0",
        "robot_type": ROBOT_TYPE,
        "total_episodes": len(entries),
        "total_frames": sum(entry.length for entry in entries),
        "total_tasks": len(tasks),
        "chunks_size": FILES_PER_CHUNK,
        "data_files_size_in_mb": DATA_FILE_MB,
        "video_files_size_in_mb": VIDEO_FILE_MB,
        "fps": FPS,
        "splits": {"train": f"0:{len(entries)}"},
        "data_path": DATA_PATH,
        "video_path": VIDEO_PATH if settings.cameras else None,
        "features": features,
    }


def _is_picture(feature: str) -> bool:
    return feature.startswith(IMAGE_PREFIX)


def _json(value: object) -> bytes:
    return (json.dumps(value, indent=1, allow_nan=False) + "\n").encode()
