"""The state of a teacher's training between two iterations, as plain values and tensors for one file."""

from copy import deepcopy
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from dapl_baselines.push_policy.push_slots_state import pack_arrays, pack_slots, restore_arrays, restore_slots
from dapl_baselines.push_policy.push_state import STATE_FIELDS
from dapl_baselines.replay import Replay
from dapl_baselines.teacher.learner import TeacherLearner
from dapl_baselines.teacher.practice import Practice
from dapl_baselines.training_report import Standing
from dapl_baselines.training_state import go_on_from

FORMAT: Final = "clutter6d-teacher-training-1"


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Course:
    """All that changes in a teacher's training.

    Attributes:
        learner: Learns.
        practice: Practises.
        replay: What is learned from; its rows are in files of their own.
    """

    learner: TeacherLearner
    practice: Practice
    replay: Replay


def copy_state(standing: Standing, course: Course) -> dict[str, object]:
    """A copy of all that decides how the training goes on; random numbers are drawn by the iteration's number."""
    learner = course.learner
    return {
        "format": FORMAT,
        **asdict(standing),
        "critic": deepcopy(learner.critic.state_dict()),
        "slow": deepcopy(learner.slow.state_dict()),
        "optimizer": deepcopy(learner.optimizer.state_dict()),
        "updates": learner.updates,
        "replay_count": course.replay.count,
        "slots": pack_slots(course.practice.slots),
        "pending": pack_arrays(_pending_arrays(course.practice)),
    }


def read_state(path: Path, course: Course) -> Standing:
    """Go on from a state: everything it holds is put back in its place.

    Raises:
        InvalidFileError: It is damaged or another training's.
    """
    return go_on_from(path, FORMAT, partial(_restore, course))


def _restore(course: Course, state: dict[str, Any]) -> None:
    learner, practice = course.learner, course.practice
    learner.critic.load_state_dict(state["critic"])
    learner.slow.load_state_dict(state["slow"])
    learner.optimizer.load_state_dict(state["optimizer"])
    learner.updates, course.replay.count = int(state["updates"]), int(state["replay_count"])
    restore_slots(practice.slots, state["slots"])
    restore_arrays(_pending_arrays(practice), state["pending"])


def _pending_arrays(practice: Practice) -> dict[str, np.ndarray]:
    pending = practice.pending
    others = {name: getattr(pending, name) for name in ("pushes", "steps", "last", "must_choose")}
    return others | {name: getattr(pending.state, name) for name in STATE_FIELDS}
