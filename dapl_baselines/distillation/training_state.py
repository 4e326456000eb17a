"""The state of a distillation between two iterations, as plain values and tensors for one file."""

from dataclasses import asdict
from pathlib import Path
from typing import Final

from clutter6d.errors import Clutter6DError, InvalidFileError
from dapl_baselines.distillation.dagger import Dagger
from dapl_baselines.policy.training_state import pack_snapshot, unpack_snapshot
from dapl_baselines.tensor_file import read_tensor_file, write_tensor_file
from dapl_baselines.training_report import Standing

FORMAT: Final = "clutter6d-distillation-1"
_DAMAGED: Final = "not the state of this distillation; give another --out, or delete the folder to begin anew"


def write_state(path: Path, standing: Standing, dagger: Dagger) -> None:
    """Write all that decides how a distillation goes on; the rows of its replay are in files of their own.

    Random numbers are drawn by the iteration's number, so there is no generator to keep.

    Raises:
        StorageError: It cannot be written.
    """
    dagger.replay.flush()
    state: dict[str, object] = {
        "format": FORMAT,
        **asdict(standing),
        "student": dagger.student.state_dict(),
        "replay_count": dagger.replay.count,
        "running": dagger.env.tally.running,
        "environments": pack_snapshot(dagger.env.snapshot()),
    }
    write_tensor_file(path, state)


def read_state(path: Path, dagger: Dagger) -> Standing:
    """Go on from a state: everything it holds is put back in its place.

    Raises:
        InvalidFileError: It is damaged or another distillation's.
    """
    state = read_tensor_file(path, what="training state")
    if state.get("format") != FORMAT:
        raise InvalidFileError(path, _DAMAGED)
    try:
        dagger.student.load_state_dict(state["student"])
        dagger.env.restore(unpack_snapshot(state["environments"]))
        dagger.env.tally.running.copy_(state["running"])
        dagger.replay.count = int(state["replay_count"])
        return Standing.of_state(state)
    except (KeyError, TypeError, ValueError, AttributeError, RuntimeError, IndexError, Clutter6DError) as error:
        reason = " ".join(str(error).split())[:120]
        raise InvalidFileError(path, f"{_DAMAGED} ({type(error).__name__}: {reason})") from None
