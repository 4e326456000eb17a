"""Recordings as transitions to train on: from one control step's end to the next, within an episode."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float64, Int

from clutter6d.envs.observation import BodyState
from clutter6d.envs.point_cloud import SceneClouds
from clutter6d.errors import InvalidValueError, MissingFileError
from clutter6d.geometry import rotation_error_rad
from clutter6d.schema import canonical_json
from dapl_baselines.interactions.clouds import CloudPairs, make_cloud_pairs
from dapl_baselines.interactions.shards import RECORDING_FILE, RecordingHeader, Shard, open_recording, read_scene
from dapl_baselines.interactions.states import unpack_states

MOVING_M = 0.002
"""A point that is displaced further in a control step is moving: 2 cm/s. Settled objects creep less than 0.1 mm."""
_REACH_M = 0.1
"""A point so far from its object's origin stands for all in telling whether an object moves."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Transitions:
    """Some transitions; one row each.

    Attributes:
        shard: Index of the shard.
        row: Row of the state before the step.
        scene: Index of the scene.
        is_moving: Whether an object moves in the step.
    """

    shard: Int[np.ndarray, "row"]
    row: Int[np.ndarray, "row"]
    scene: Int[np.ndarray, "row"]
    is_moving: Bool[np.ndarray, "row"]

    def __len__(self) -> int:
        """How many."""
        return len(self.row)

    def __getitem__(self, rows: Int[np.ndarray, "some"] | Bool[np.ndarray, "row"]) -> "Transitions":
        """Some of them."""
        return Transitions(
            shard=self.shard[rows], row=self.row[rows], scene=self.scene[rows], is_moving=self.is_moving[rows]
        )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class InteractionData:
    """All transitions of some data sets; states stay in their files until they are asked for.

    Attributes:
        headers: Of the recordings.
        training: Transitions of the scenes that a training may use.
        validation: Transitions of the scenes that are held out.
        sha256: Names exactly this data, wherever it lies.
    """

    headers: tuple[RecordingHeader, ...]
    training: Transitions
    validation: Transitions
    sha256: str
    _shards: tuple[Shard, ...]
    _scenes: SceneClouds[np.ndarray]

    def states(self, chosen: Transitions) -> tuple[BodyState[np.ndarray], BodyState[np.ndarray]]:
        """The states before and after each step."""
        rows = np.empty((2, len(chosen), self._shards[0].states.shape[1]))
        for shard in np.unique(chosen.shard):
            here = np.flatnonzero(chosen.shard == shard)
            first = chosen.row[here]
            rows[0, here], rows[1, here] = self._shards[shard].states[first], self._shards[shard].states[first + 1]
        return unpack_states(rows[0]), unpack_states(rows[1])

    def clouds(self, chosen: Transitions, *, yaw_rad: Float64[np.ndarray, "row"] | None = None) -> CloudPairs:
        """What was seen before and after each step; arguments as :func:`make_cloud_pairs`."""
        now, later = self.states(chosen)
        return make_cloud_pairs(self._scenes[chosen.scene], now, later, yaw_rad=yaw_rad)


def open_interactions(folders: Sequence[Path]) -> InteractionData:
    """The transitions of data sets.

    Args:
        folders: Each a data set, whose recordings are all taken, or one recording.

    Raises:
        MissingFileError: A folder holds no recording.
        InvalidFileError: A recording is damaged.
        InvalidValueError: The recordings do not go together, or nothing is left to train on or to hold out.
    """
    recordings = [(folder, *open_recording(folder)) for folder in _find_recordings(folders)]
    headers = tuple(header for _, header, _ in recordings)
    objects = {header.objects for header in headers}
    if len(objects) != 1:
        raise InvalidValueError(f"the recordings have scenes of {sorted(objects)} objects; train on those of one track")
    scenes, shards, parts = _Scenes(), list[Shard](), list[tuple[Transitions, np.ndarray]]()
    for folder, header, found in recordings:
        for shard in found:
            parts.append(_transitions(len(shards), shard, scenes.indices(folder, header, shard), header))
            shards.append(shard)
    if not parts:
        raise InvalidValueError(f"no episode is recorded yet in {folders[0]}; go on with: dapl record")
    transitions, is_held_out = _joined(parts)
    if is_held_out.all() or not is_held_out.any():
        what = "hold out" if not is_held_out.any() else "train on"
        raise InvalidValueError(f"{len(transitions)} transitions and none to {what}; record more steps")
    return InteractionData(
        headers=headers,
        training=transitions[~is_held_out],
        validation=transitions[is_held_out],
        sha256=_sha256(headers, shards),
        _shards=tuple(shards),
        _scenes=scenes.read(objects.pop()),
    )


class _Scenes:
    """Numbers the scenes of recordings; the same scene of several recordings is one."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, str], tuple[int, Path]] = {}

    def indices(self, folder: Path, header: RecordingHeader, shard: Shard) -> Int[np.ndarray, "episode"]:
        """The number of each episode's scene."""
        keys = [(header.split_sha256, entry.scene_id) for entry in shard.episodes]
        for key in keys:
            self._found.setdefault(key, (len(self._found), folder))
        return np.array([self._found[key][0] for key in keys], dtype=np.int64)

    def read(self, objects: int) -> SceneClouds[np.ndarray]:
        """The points of all scenes, in their order."""
        clouds = SceneClouds.allocate(len(self._found), objects)
        for (_, scene_id), (index, folder) in self._found.items():
            for name, values in read_scene(folder, scene_id, objects).items():
                getattr(clouds, name)[index] = values
        return clouds


def _find_recordings(folders: Sequence[Path]) -> list[Path]:
    found: list[Path] = []
    for folder in folders:
        here = [folder] if (folder / RECORDING_FILE).is_file() else []
        below = sorted(path.parent for path in folder.glob(f"*/{RECORDING_FILE}"))
        if not here and not below:
            raise MissingFileError("recording of interactions", folder, "make one with: dapl record")
        found += here or below
    return list(dict.fromkeys(path.resolve() for path in found))


def _transitions(
    number: int, shard: Shard, scenes: Int[np.ndarray, "episode"], header: RecordingHeader
) -> tuple[Transitions, Bool[np.ndarray, "row"]]:
    """All transitions of a shard, and which of them are held out."""
    steps, validation = [entry.steps for entry in shard.episodes], set(header.validation_scenes)
    held_out = [entry.scene_id in validation for entry in shard.episodes]
    rows = np.concatenate([np.arange(entry.rows.start, entry.rows.stop - 1) for entry in shard.episodes])
    transitions = Transitions(
        shard=np.full(len(rows), number),
        row=rows,
        scene=np.repeat(scenes, steps),
        is_moving=_is_moving(shard.states[: shard.rows])[rows],
    )
    return transitions, np.repeat(held_out, steps)


def _is_moving(states: Float64[np.ndarray, "state row"]) -> Bool[np.ndarray, "step"]:
    """Whether any object moves from each state to the next."""
    poses = unpack_states(states).object_poses
    distance = np.sqrt(((poses[1:, :, :3] - poses[:-1, :, :3]) ** 2).sum(axis=-1))
    angle = rotation_error_rad(poses[1:, :, 3:], poses[:-1, :, 3:])
    return (distance + _REACH_M * angle > MOVING_M).any(axis=1)


def _joined(parts: Sequence[tuple[Transitions, np.ndarray]]) -> tuple[Transitions, Bool[np.ndarray, "row"]]:
    columns = {
        name: np.concatenate([getattr(transitions, name) for transitions, _ in parts])
        for name in ("shard", "row", "scene", "is_moving")
    }
    return Transitions(**columns), np.concatenate([held_out for _, held_out in parts])


def _sha256(headers: Sequence[RecordingHeader], shards: Sequence[Shard]) -> str:
    episodes = [[entry.sha256 for entry in shard.episodes] for shard in shards]
    return hashlib.sha256(canonical_json([[header.model_dump() for header in headers], episodes])).hexdigest()
