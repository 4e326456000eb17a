"""The NaN guard's file: the state before a simulation step that went wrong, so that it can be looked at again."""

import base64
import logging
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float64
from pydantic import Field

from clutter6d.envs.slots import ClutterSlots
from clutter6d.envs.tasks import TaskSource
from clutter6d.errors import InvalidFileError, InvalidValueError
from clutter6d.schema import FileModel, read_model, write_model

_log = logging.getLogger(__name__)


class UnstableState(FileModel):
    """``unstable/<scene_id>@<pair>-<step>.json``.

    Attributes:
        scenes_sha256: The split or folder of scenes.
        scene_id: The scene.
        pair: Index of the goal pair.
        step: Control steps that had gone well.
        engine: MuJoCo's version.
        state_base64: The simulation's integration state before the step, with its joint targets, as float64.
    """

    schema_version: int = 1
    scenes_sha256: str
    scene_id: str = Field(max_length=200)
    pair: int = Field(ge=0)
    step: int = Field(ge=0)
    engine: str
    state_base64: str = Field(max_length=1 << 20)


def report_unstable(
    scenes_sha256: str, key: tuple[str, int], step: int, state: Float64[np.ndarray, "state"], folder: Path | None
) -> None:
    """Warn of a step that went wrong, and keep the state before it if there is a folder for it.

    Args:
        scenes_sha256: The split or folder of scenes.
        key: Scene and pair.
        step: Control steps that had gone well.
        state: The simulation's integration state before the step, with its joint targets.
        folder: Where the state is kept.

    Raises:
        StorageError: It cannot be written.
    """
    where = f"scene {key[0]}, pair {key[1]}, step {step}"
    if folder is None:
        _log.warning("the simulation became invalid at %s; name a folder (unstable_dir) to keep its state", where)
        return
    found = UnstableState(
        scenes_sha256=scenes_sha256,
        scene_id=key[0],
        pair=key[1],
        step=step,
        engine=f"mujoco {mujoco.__version__}",
        state_base64=base64.b64encode(np.ascontiguousarray(state, dtype="<f8").tobytes()).decode(),
    )
    path = folder / f"{found.scene_id}@{found.pair}-{found.step}.json"
    write_model(path, found)
    _log.warning("the simulation became invalid at %s; look again with: clutter6d replay %s", where, path)


def replay_unstable(path: Path, source: TaskSource) -> bool:
    """Simulate the step again; returns whether it goes wrong again.

    Raises:
        InvalidFileError: The file is damaged, or its state is of another layout.
        InvalidValueError: The scenes are others.
        UnknownNameError: There is no such scene.
    """
    found = read_model(path, UnstableState, what="unstable state")
    if found.scenes_sha256 != source.sha256:
        raise InvalidValueError(
            f"{path} is of other scenes (SHA-256 {found.scenes_sha256[:12]}); give them by --scenes"
        )
    task, slot = source.choose(found.scene_id, found.pair), np.zeros(1, dtype=np.int64)
    env = ClutterSlots([task.model], threads=1)
    env.load(slot, [task.model], [task.pair])
    env.batch.states[0] = _read_state(found, path, env.batch.states.shape[1])
    return bool(env.advance(slot)[0])


def _read_state(found: UnstableState, path: Path, size: int) -> Float64[np.ndarray, "state"]:
    try:
        state = np.frombuffer(base64.b64decode(found.state_base64, validate=True), dtype="<f8").astype(np.float64)
    except ValueError as error:
        raise InvalidFileError(path, "its state cannot be decoded") from error
    if len(state) != size:
        raise InvalidFileError(path, f"its state has {len(state)} numbers, the scene's has {size}")
    return state
