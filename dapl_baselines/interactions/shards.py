"""Recorded interactions on disk: shards of bounded size that are mapped into memory, and safe against any kill.

A data set is a folder of recordings, one for each policy and seed::

    RECORDING/recording.json          everything its episodes depend on
    RECORDING/scenes/SCENE_ID.npz     canonical points and masses of a scene's objects
    RECORDING/shards/00000/states.npy, actions.npy, shard.json

An episode's rows are written first and its entry in ``shard.json`` last, atomically; so a kill loses nothing but the
episodes under way. Rows beyond those of the entries mean nothing. Every entry has the hash of its rows.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float32, Float64
from pydantic import Field

from clutter6d.assets.asset import SURFACE_POINTS
from clutter6d.envs.action import ACTION_SIZE
from clutter6d.errors import InvalidFileError
from clutter6d.schema import ArraySpec, FileModel, read_arrays, read_model
from dapl_baselines.interactions.states import row_size

SHARD_ROWS = 16_384
"""States of a shard: 9 MB with 4 objects, 23 MB with 12."""
RECORDING_FILE, SHARD_FILE = "recording.json", "shard.json"
STATES_FILE, ACTIONS_FILE = "states.npy", "actions.npy"

SceneId = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,99}$")]
"""Names a file, so it must not lead elsewhere."""


class RecordingHeader(FileModel):
    """Everything that the episodes of a recording depend on.

    Attributes:
        policy: The policy's name.
        policy_hash: Hash of its method, settings and weights.
        scenes: The scenes, as the command was given them.
        split_sha256: Names exactly this set of scenes.
        validation_scenes: Scenes of them that no training may use (:mod:`dapl_baselines.validation`).
        objects: Objects of each scene.
        seed: Seed of what the policy draws, and of the order of the episodes.
        max_steps: Control steps of an episode at most.
        engine: The simulator's version.
        clutter6d: This package's version.
    """

    schema_version: Literal[1] = 1
    policy: str
    policy_hash: str = Field(pattern="^[0-9a-f]{64}$")
    scenes: str
    split_sha256: str = Field(pattern="^[0-9a-f]{64}$")
    validation_scenes: tuple[SceneId, ...] = Field(min_length=1)
    objects: int = Field(ge=2, le=64)
    seed: int
    max_steps: int = Field(ge=1, lt=SHARD_ROWS)
    engine: str
    clutter6d: str


class EpisodeEntry(FileModel):
    """Where an episode's ``steps + 1`` states lie in its shard; the action of the last one is zero."""

    scene_id: SceneId
    pair: int = Field(ge=0)
    outcome: str
    first_row: int = Field(ge=0, lt=SHARD_ROWS)
    steps: int = Field(ge=1, lt=SHARD_ROWS)
    sha256: str = Field(pattern="^[0-9a-f]{64}$")

    @property
    def rows(self) -> slice:
        """Its rows."""
        return slice(self.first_row, self.first_row + self.steps + 1)


class ShardHeader(FileModel):
    """The episodes of a shard."""

    schema_version: Literal[1] = 1
    episodes: tuple[EpisodeEntry, ...] = ()


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Shard:
    """A shard whose entries are those of its rows; the arrays are maps of its files.

    Attributes:
        folder: Where it is.
        episodes: Its episodes.
        states: Rows of :mod:`dapl_baselines.interactions.states`.
        actions: Residuals asked for in each state [rad].
    """

    folder: Path
    episodes: tuple[EpisodeEntry, ...]
    states: Float64[np.ndarray, "state row"]
    actions: Float32[np.ndarray, "state 7"]

    @property
    def rows(self) -> int:
        """Rows in use."""
        return self.episodes[-1].rows.stop if self.episodes else 0


def open_recording(folder: Path) -> tuple[RecordingHeader, tuple[Shard, ...]]:
    """A recording to be read.

    Raises:
        MissingFileError: There is none.
        InvalidFileError: It is damaged.
    """
    header = read_model(folder / RECORDING_FILE, RecordingHeader, what="recording of interactions")
    return header, tuple(read_shards(folder, header.objects))


def read_shards(folder: Path, objects: int) -> Iterator[Shard]:
    """The shards of a recording in order; one without a header was never written to and is left out.

    Raises:
        InvalidFileError: A file is damaged.
    """
    for path in sorted((folder / "shards").glob(f"*/{SHARD_FILE}")):
        header = read_model(path, ShardHeader, what="header of a shard")
        shard = map_shard(path.parent, header.episodes, objects)
        for entry in shard.episodes:
            if not _is_intact(entry, shard):
                raise InvalidFileError(path, f"the rows of {entry.scene_id} pair {entry.pair} are not those recorded")
        yield shard


def map_shard(folder: Path, episodes: tuple[EpisodeEntry, ...], objects: int) -> Shard:
    """A shard with its files mapped into memory.

    Raises:
        InvalidFileError: A file is not one of a shard.
    """
    states = _map(folder / STATES_FILE, "<f8", row_size(objects))
    return Shard(
        folder=folder, episodes=episodes, states=states, actions=_map(folder / ACTIONS_FILE, "<f4", ACTION_SIZE)
    )


def read_scene(folder: Path, scene_id: str, objects: int) -> dict[str, np.ndarray]:
    """The canonical points of a scene, as :class:`~clutter6d.envs.point_cloud.SceneClouds` has them.

    Raises:
        MissingFileError: The recording has no such scene.
        InvalidFileError: Its file is damaged.
    """
    return read_arrays(scene_path(folder, scene_id), scene_specs(objects), what="points of a scene")


def scene_path(folder: Path, scene_id: str) -> Path:
    """Where the points of a scene are."""
    return folder / "scenes" / f"{scene_id}.npz"


def scene_specs(objects: int) -> dict[str, ArraySpec]:
    """What the file of a scene's points holds."""
    return {
        "points": ArraySpec(dtype="<f4", shape=(objects, 3, SURFACE_POINTS)),
        "point_mass": ArraySpec(dtype="<f4", shape=(objects,)),
        "target_centroid": ArraySpec(dtype="<f4", shape=(3, 1)),
    }


def _map(path: Path, dtype: str, columns: int) -> np.ndarray:
    """A file of rows, mapped into memory; nothing is unpickled."""
    try:
        array = np.lib.format.open_memmap(path, mode="r")
    except (OSError, ValueError) as error:
        raise InvalidFileError(path, f"not rows of a recording: {' '.join(str(error).split())}") from None
    if not ArraySpec(dtype=dtype, shape=(SHARD_ROWS, columns)).matches(array):
        raise InvalidFileError(path, f"holds {array.dtype}{array.shape}, expected {dtype}{(SHARD_ROWS, columns)}")
    return array


def _is_intact(entry: EpisodeEntry, shard: Shard) -> bool:
    if entry.rows.stop > SHARD_ROWS:
        return False
    states, actions = shard.states[entry.rows], shard.actions[entry.rows]
    is_finite = bool(np.isfinite(states).all() and np.isfinite(actions).all())
    return is_finite and rows_sha256(states, actions) == entry.sha256


def rows_sha256(states: np.ndarray, actions: np.ndarray) -> str:
    """Hash of an episode's states and actions."""
    digest = hashlib.sha256(np.ascontiguousarray(states).astype("<f8").tobytes())
    digest.update(np.ascontiguousarray(actions).astype("<f4").tobytes())
    return digest.hexdigest()
