"""A recording that is added to, episode by episode; where its files are is told at :mod:`.shards`."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from clutter6d.envs.action import ACTION_SIZE
from clutter6d.envs.point_cloud import SceneClouds
from clutter6d.errors import StorageError
from clutter6d.eval.runner import EpisodeKey
from clutter6d.schema import write_arrays, write_model
from dapl_baselines.interactions.recorder import Interaction
from dapl_baselines.interactions.shards import (
    ACTIONS_FILE,
    RECORDING_FILE,
    SHARD_FILE,
    SHARD_ROWS,
    STATES_FILE,
    EpisodeEntry,
    RecordingHeader,
    Shard,
    ShardHeader,
    map_shard,
    read_shards,
    rows_sha256,
    scene_path,
    scene_specs,
)
from dapl_baselines.interactions.states import row_size
from dapl_baselines.run_folder import claim


class Recording:
    """A recording that is added to.

    Args:
        folder: Its folder, new or continued.
        header: What its episodes depend on.

    Raises:
        InvalidValueError: The folder holds something else, or a recording with other settings.
        InvalidFileError: A file in it is damaged.
        StorageError: It cannot be written.
    """

    def __init__(self, folder: Path, header: RecordingHeader) -> None:
        self._folder, self._header = folder, header
        claim(folder / RECORDING_FILE, header, what="recording")
        self._shards = list(read_shards(folder, header.objects))

    @property
    def steps(self) -> int:
        """Control steps recorded."""
        return sum(entry.steps for shard in self._shards for entry in shard.episodes)

    @property
    def keys(self) -> set[EpisodeKey]:
        """Scene and pair of the episodes recorded."""
        return {(entry.scene_id, entry.pair) for shard in self._shards for entry in shard.episodes}

    def add(self, episode: Interaction) -> None:
        """Keep an episode.

        Raises:
            StorageError: The disk is full, or the folder cannot be written.
        """
        self._keep_scene(episode)
        first = self._shards[-1].rows if self._shards else SHARD_ROWS
        if first + len(episode.states) > SHARD_ROWS:
            first, folder = 0, self._folder / "shards" / f"{len(self._shards):05d}"
            self._shards.append(_new_shard(folder, self._header.objects))
        self._shards[-1] = _extended(self._shards[-1], episode, first)

    def _keep_scene(self, episode: Interaction) -> None:
        path = scene_path(self._folder, episode.key[0])
        if not path.is_file():
            clouds = SceneClouds.allocate(1, self._header.objects)
            clouds.load(0, episode.scene_model)
            arrays = {name: getattr(clouds, name)[0] for name in scene_specs(self._header.objects)}
            write_arrays(path, arrays)


def _new_shard(folder: Path, objects: int) -> Shard:
    """An empty shard; all its bytes are there from the start, so that no disk is full while rows are written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        np.save(folder / STATES_FILE, np.zeros((SHARD_ROWS, row_size(objects)), dtype="<f8"))
        np.save(folder / ACTIONS_FILE, np.zeros((SHARD_ROWS, ACTION_SIZE), dtype="<f4"))
    except OSError as error:
        raise StorageError(f"cannot write {folder}: {error.strerror}; nothing earlier was changed") from None
    return map_shard(folder, (), objects)


def _extended(shard: Shard, episode: Interaction, first: int) -> Shard:
    """The shard with one more episode."""
    actions = np.concatenate([episode.actions, np.zeros((1, ACTION_SIZE), dtype=np.float32)])
    entry = EpisodeEntry(
        scene_id=episode.key[0],
        pair=episode.key[1],
        outcome=episode.outcome,
        first_row=first,
        steps=len(episode.actions),
        sha256=rows_sha256(episode.states, actions),
    )
    for name, values in ((STATES_FILE, episode.states), (ACTIONS_FILE, actions)):
        rows = np.lib.format.open_memmap(shard.folder / name, mode="r+")
        rows[entry.rows] = values
        rows.flush()
    episodes = (*shard.episodes, entry)
    write_model(shard.folder / SHARD_FILE, ShardHeader(episodes=episodes))
    return replace(shard, episodes=episodes)
