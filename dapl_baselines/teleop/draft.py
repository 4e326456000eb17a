"""An attempt that is under way: its actions, on disk as they are made, so that leaving loses nothing.

Simulation gives the same to the bit, so the actions are the attempt: played again, they lead to where it was left. An
attempt that was begun is therefore never begun afresh, and nobody sees a task twice.

drafts/<scene_id>@<pair>.f32    float32, little-endian, seven for each control step
"""

import contextlib
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from clutter6d.envs.action import ACTION_SIZE
from clutter6d.errors import InvalidFileError, StorageError
from clutter6d.schema import read_bytes

_ROW_BYTES = 4 * ACTION_SIZE


class Draft:
    """The actions of one attempt so far.

    Args:
        path: Its file, there or not.
        max_steps: Control steps of an attempt at most.

    Raises:
        InvalidFileError: The file holds something else.
    """

    def __init__(self, path: Path, max_steps: int) -> None:
        self._path, self._max_steps = path, max_steps
        self._rows = list(_read(path, max_steps)) if path.exists() else []

    def __len__(self) -> int:
        """Control steps that are decided."""
        return len(self._rows)

    def __getitem__(self, step: int) -> Float32[np.ndarray, "7"]:
        """The action of a step [rad]."""
        return self._rows[step]

    def append(self, action: Float32[np.ndarray, "7"]) -> None:
        """Decide the next step.

        Raises:
            StorageError: It cannot be written.
        """
        self._extend([action])

    def fill(self) -> None:
        """Decide that the arm stands still for the rest of the attempt."""
        self._extend([np.zeros(ACTION_SIZE, dtype=np.float32)] * (self._max_steps - len(self._rows)))

    def remove(self) -> None:
        """Forget it, once the attempt is over and kept elsewhere."""
        self._path.unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # other drafts are in it, or it never was
            self._path.parent.rmdir()

    def _extend(self, rows: list[Float32[np.ndarray, "7"]]) -> None:
        content = b"".join(row.astype("<f4").tobytes() for row in rows)
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("r+b" if self._path.exists() else "wb") as file:
                file.seek(len(self._rows) * _ROW_BYTES)  # over what a kill left of half a row
                file.write(content)
        except OSError as error:
            raise StorageError(f"cannot write {self._path}: {error.strerror}; the attempt is kept up to here") from None
        self._rows += rows


def draft_path(folder: Path, scene_id: str, pair: int) -> Path:
    """Where the draft of an attempt lies in an evaluation's folder."""
    return folder / "drafts" / f"{scene_id}@{pair:04d}.f32"


def _read(path: Path, max_steps: int) -> Float32[np.ndarray, "step 7"]:
    content = read_bytes(path, what="attempt under way", max_bytes=(max_steps + 1) * _ROW_BYTES)
    whole = len(content) - len(content) % _ROW_BYTES
    rows = np.frombuffer(content[:whole], dtype="<f4").reshape(-1, ACTION_SIZE).astype(np.float32)
    if len(rows) > max_steps or not np.isfinite(rows).all():
        raise InvalidFileError(path, "not an attempt under way; delete it to begin the attempt afresh")
    return rows
