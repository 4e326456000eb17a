"""What came of one iteration of a teacher's training, and its rows in the curves."""

from dataclasses import asdict, dataclass

from dapl_baselines.teacher.learner import Losses
from dapl_baselines.training_report import TrainingReport


@dataclass(frozen=True, kw_only=True, slots=True)
class TeacherReport(TrainingReport):
    """Practice, and what was learned beside it.

    Attributes:
        pushes: Pushes carried out since the beginning.
        updates: Steps of the optimiser since the beginning.
        losses: Mean losses of the iteration; ``None`` while there is too little to learn from.
    """

    pushes: int
    updates: int
    losses: Losses | None

    def curve_row(self) -> dict[str, float]:
        """Its row in ``training.csv``; the column that begins with ``timing_`` is the only one that may differ."""
        nothing = dict.fromkeys(Losses.__dataclass_fields__, float("nan"))
        return {
            "environment_steps": self.environment_steps,
            "pushes": self.pushes,
            "updates": self.updates,
            **asdict(self.episodes),
            **(nothing if self.losses is None else asdict(self.losses)),
            "timing_seconds": self.seconds,
        }
