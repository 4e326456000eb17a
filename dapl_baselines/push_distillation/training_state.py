"""The state of a distillation of pushes between two iterations, as plain values and tensors for one file."""

from copy import deepcopy
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import torch

from dapl_baselines.push_distillation.learner import StudentLearner
from dapl_baselines.push_distillation.practice import StudentPractice
from dapl_baselines.push_policy.push_slots_state import pack_slots, restore_slots
from dapl_baselines.replay import Replay
from dapl_baselines.training_report import Standing
from dapl_baselines.training_state import go_on_from

FORMAT: Final = "clutter6d-push-distillation-1"


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
    return go_on_from(path, FORMAT, partial(_restore, course), what="distillation")


def _restore(course: Course, state: dict[str, Any]) -> None:
    learner, practice = course.learner, course.practice
    learner.student.load_state_dict(state["student"])
    learner.optimizer.load_state_dict(state["optimizer"])
    learner.updates, course.replay.count = int(state["updates"]), int(state["replay_count"])
    restore_slots(practice.slots, state["slots"])
    practice.must_choose = state["must_choose"].numpy().copy()
