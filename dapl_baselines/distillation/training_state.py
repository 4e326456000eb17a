"""The state of a distillation between two iterations, as plain values and tensors for one file."""

from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from dapl_baselines.distillation.dagger import Dagger
from dapl_baselines.tensor_file import write_tensor_file
from dapl_baselines.training_report import Standing
from dapl_baselines.training_state import go_on_from, pack_snapshot, unpack_snapshot

FORMAT: Final = "clutter6d-distillation-1"


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

    def restore(state: dict[str, Any]) -> None:
        dagger.student.load_state_dict(state["student"])
        dagger.env.restore(unpack_snapshot(state["environments"]))
        dagger.env.tally.running.copy_(state["running"])
        dagger.replay.count = int(state["replay_count"])

    return go_on_from(path, FORMAT, restore, what="distillation")
