"""What trainings of policies share: how far they are, what an iteration tells, and how a command follows it."""

import time
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any, TypeVar

from dapl_baselines.policy.episode_tally import EpisodeMeans
from dapl_baselines.validation_run import ValidationResult


@dataclass(frozen=True, kw_only=True, slots=True)
class Standing:
    """How far a training is.

    Attributes:
        iteration: Iterations made.
        seconds: Time they took.
        best_success: Best success rate on the validation scenes; -1 before the first look.
    """

    iteration: int = 0
    seconds: float = 0.0
    best_success: float = -1.0

    @classmethod
    def of_state(cls, state: Mapping[str, Any]) -> "Standing":
        """From the state of a training that its values stand in; a name that is missing is a ``KeyError``."""
        return cls(
            iteration=int(state["iteration"]),
            seconds=float(state["seconds"]),
            best_success=float(state["best_success"]),
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class TrainingReport(ABC):
    """One rollout and what was learned from it.

    Attributes:
        iteration: Its number, from 1.
        environment_steps: Control steps of all environments since the beginning.
        seconds: Time of rollouts and updates since the beginning.
        episodes: The episodes that ended in it.
        validation: The look at the validation scenes, if there was one.
    """

    iteration: int
    environment_steps: int
    seconds: float = 0.0
    episodes: EpisodeMeans
    validation: ValidationResult | None = None

    @abstractmethod
    def curve_row(self) -> dict[str, float]:
        """Its row in ``training.csv``; columns that begin with ``timing_`` are the only ones that may differ."""

    def validation_row(self) -> dict[str, float]:
        """Its row in ``validation.csv``; empty without a look."""
        if self.validation is None:
            return {}
        return {
            "environment_steps": self.environment_steps,
            **asdict(self.validation),
            "timing_seconds": self.seconds,
        }

    def describe_look(self) -> str:
        """One line on the look at the validation scenes; empty without one."""
        if self.validation is None:
            return ""
        return (
            f"iteration {self.iteration}, {self.environment_steps:,} steps, {self.seconds / 60:.1f} min: "
            f"{self.validation.success_rate:.1%} of {self.validation.episodes} validation episodes succeed"
        )


Report = TypeVar("Report")


def until(reports: Iterator[Report], max_minutes: float | None) -> Iterator[Report]:
    """The reports that come in time."""
    start = time.monotonic()
    for report in reports:
        yield report
        if max_minutes is not None and time.monotonic() - start >= 60 * max_minutes:
            return
