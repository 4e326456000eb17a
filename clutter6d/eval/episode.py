"""What is kept of an episode, in memory and in its own small file."""

import base64
import binascii
import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float32
from pydantic import Field

from clutter6d.envs.action import ACTION_SIZE
from clutter6d.envs.termination import Outcome
from clutter6d.errors import InvalidFileError
from clutter6d.schema import FileModel, read_model, write_model

TIMING_PREFIX = "timing_"
MAX_EPISODE_BYTES = 8 << 20


class EpisodeRow(FileModel):
    """One row of the table of episodes; columns that begin with ``timing_`` are the only ones that may differ.

    Attributes:
        scene_id: The scene.
        pair: Index of the goal pair.
        track: The scene's track.
        outcome: How the episode ended.
        steps: Control steps made.
        is_success: Whether it ended at success: 3-D position and rotation within the tolerances.
        is_planar_success: Whether, at any control step's end, position on the table plane and rotation were.
        is_symmetric_success: Whether, at any control step's end, 3-D position and symmetry-aware rotation were.
        holds: Success that still stands 1 s after the robot stopped at the episode's end.
        position_error_m: Distance to the goal at the end.
        planar_error_m: The same on the table plane.
        rotation_error_rad: Angle to the goal at the end.
        symmetric_rotation_error_rad: The smallest angle over the target's symmetries.
        mean_offset_cm: Mean offset of the other objects.
        actions_sha256: Hash of the actions.
        final_state_sha256: Hash of the simulation's full state at the end.
        timing_seconds: Wall time from start to end, shared with the episodes that ran beside it.
    """

    scene_id: str
    pair: int = Field(ge=0)
    track: str
    outcome: Outcome
    steps: int = Field(ge=1)
    is_success: bool
    is_planar_success: bool
    is_symmetric_success: bool
    holds: bool
    position_error_m: float
    planar_error_m: float
    rotation_error_rad: float
    symmetric_rotation_error_rad: float
    mean_offset_cm: float
    actions_sha256: str
    final_state_sha256: str
    timing_seconds: float

    @property
    def key(self) -> tuple[str, int]:
        """Scene and pair."""
        return (self.scene_id, self.pair)

    def differences(self, other: "EpisodeRow") -> tuple[str, ...]:
        """Names of the columns that differ, timing aside."""
        return tuple(
            name
            for name in type(self).model_fields
            if not name.startswith(TIMING_PREFIX) and getattr(self, name) != getattr(other, name)
        )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class EpisodeRecord:
    """A finished episode: its row, and the residuals the policy asked for [rad]."""

    row: EpisodeRow
    actions: Float32[np.ndarray, "step 7"]


class _EpisodeFile(FileModel):
    schema_version: Literal[1] = 1
    row: EpisodeRow
    actions_base64: str


def actions_sha256(actions: Float32[np.ndarray, "step 7"]) -> str:
    """Hash of an episode's actions."""
    return hashlib.sha256(np.ascontiguousarray(actions).astype("<f4").tobytes()).hexdigest()


def episode_path(folder: Path, scene_id: str, pair: int) -> Path:
    """Where an episode's file lies in a journal."""
    return folder / f"{scene_id}@{pair:04d}.json"


def write_episode(folder: Path, record: EpisodeRecord) -> None:
    """Write one episode's file, atomically."""
    actions = base64.b64encode(record.actions.astype("<f4").tobytes()).decode()
    path = episode_path(folder, record.row.scene_id, record.row.pair)
    write_model(path, _EpisodeFile(row=record.row, actions_base64=actions))


def read_episode(path: Path) -> EpisodeRecord:
    """Read one episode's file.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is not one of this package, or its actions are not those it was written with.
    """
    file = read_model(path, _EpisodeFile, what="episode file", max_bytes=MAX_EPISODE_BYTES)
    try:
        flat = np.frombuffer(base64.b64decode(file.actions_base64, validate=True), dtype="<f4")
        actions = flat.reshape(-1, ACTION_SIZE).astype(np.float32)
    except (binascii.Error, ValueError):
        raise InvalidFileError(path, "not a valid episode file: its actions cannot be read; delete it") from None
    if actions_sha256(actions) != file.row.actions_sha256 or len(actions) != file.row.steps:
        raise InvalidFileError(path, "not a valid episode file: its actions do not match its row; delete it")
    return EpisodeRecord(row=file.row, actions=actions)
