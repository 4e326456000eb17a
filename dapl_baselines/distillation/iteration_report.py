"""What came of one iteration of a distillation, and its rows in the curves."""

from dataclasses import asdict, dataclass

from dapl_baselines.distillation.student import DistillationLosses
from dapl_baselines.training_report import TrainingReport


@dataclass(frozen=True, kw_only=True, slots=True)
class DistillationReport(TrainingReport):
    """One rollout and what was learned after it.

    Attributes:
        teacher_share: Share of the environments that the teacher acted in.
        losses: Means over the updates.
    """

    teacher_share: float
    losses: DistillationLosses

    def curve_row(self) -> dict[str, float]:
        """Its row in ``training.csv``; columns that begin with ``timing_`` are the only ones that may differ."""
        return {
            "environment_steps": self.environment_steps,
            **asdict(self.episodes),
            **{f"{name}_loss": value for name, value in asdict(self.losses).items()},
            "teacher_share": self.teacher_share,
            "timing_seconds": self.seconds,
        }
