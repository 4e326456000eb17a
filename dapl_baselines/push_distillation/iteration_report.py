"""What came of one iteration of a distillation of pushes, and its rows in the curves."""

from dataclasses import asdict, dataclass

from dapl_baselines.push_distillation.learner import StudentLosses
from dapl_baselines.training_report import TrainingReport


@dataclass(frozen=True, kw_only=True, slots=True)
class StudentReport(TrainingReport):
    """Practice, and what was learned beside it.

    Attributes:
        lessons: States that the teacher has judged since the beginning.
        losses: Mean losses of the iteration; ``None`` while there is too little to learn from.
    """

    lessons: int
    losses: StudentLosses | None

    def curve_row(self) -> dict[str, float]:
        """Its row in ``training.csv``; the column that begins with ``timing_`` is the only one that may differ."""
        nothing = dict.fromkeys(StudentLosses.__dataclass_fields__, float("nan"))
        return {
            "environment_steps": self.environment_steps,
            "lessons": self.lessons,
            **asdict(self.episodes),
            **(nothing if self.losses is None else asdict(self.losses)),
            "timing_seconds": self.seconds,
        }
