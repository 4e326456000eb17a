"""The state of a distillation of pushes between two iterations, as plain values and tensors for one file."""

from copy import deepcopy
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import torch

from clutter6d.errors import Clutter6DError, InvalidFileError
from dapl_baselines.push_distillation.learner import StudentLearner
from dapl_baselines.push_distillation.practice import StudentPractice
from dapl_baselines.push_policy.push_slots_state import pack_slots, restore_slots
from dapl_baselines.replay import Replay
from dapl_baselines.tensor_file import read_tensor_file
from dapl_baselines.training_report import Standing

FORMAT: Final = "clutter6d-push-distillation-1"
_DAMAGED: Final = "not the state of this distillation; give another --out, or delete the folder to begin anew"


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Course:
    """All that changes in a distillation of pushes.

    Attributes:
        learner: Learns.
        practice: Practises.
        replay: What is learned from; its rows are in files of their own.
    """

    learner: StudentLearner
    practice: StudentPractice
    replay: Replay


def copy_state(standing: Standing, course: Course) -> dict[str, object]:
    """A copy of all that decides how it goes on; random numbers are drawn by the iteration's number."""
    learner = course.learner
    return {
        "format": FORMAT,
        **asdict(standing),
        "student": deepcopy(learner.student.state_dict()),
        "optimizer": deepcopy(learner.optimizer.state_dict()),
        "updates": learner.updates,
        "replay_count": course.replay.count,
        "slots": pack_slots(course.practice.slots),
        "must_choose": torch.from_numpy(course.practice.must_choose.copy()),
    }


def read_state(path: Path, course: Course) -> Standing:
    """Go on from a state: everything it holds is put back in its place.

    Raises:
        InvalidFileError: It is damaged or another distillation's.
    """
    state = read_tensor_file(path, what="training state")
    if state.get("format") != FORMAT:
        raise InvalidFileError(path, _DAMAGED)
    try:
        _restore(state, course)
        return Standing.of_state(state)
    except (KeyError, TypeError, ValueError, AttributeError, RuntimeError, IndexError, Clutter6DError) as error:
        reason = " ".join(str(error).split())[:120]
        raise InvalidFileError(path, f"{_DAMAGED} ({type(error).__name__}: {reason})") from None


def _restore(state: dict[str, Any], course: Course) -> None:
    learner, practice = course.learner, course.practice
    learner.student.load_state_dict(state["student"])
    learner.optimizer.load_state_dict(state["optimizer"])
    learner.updates, course.replay.count = int(state["updates"]), int(state["replay_count"])
    restore_slots(practice.slots, state["slots"])
    practice.must_choose = state["must_choose"].numpy().copy()
