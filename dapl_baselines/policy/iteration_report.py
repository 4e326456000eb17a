"""What came of one iteration of a policy training, and its rows in the curves."""

from dataclasses import asdict, dataclass

from dapl_baselines.policy.rsl_runner import UpdateReport
from dapl_baselines.training_report import TrainingReport


@dataclass(frozen=True, kw_only=True, slots=True)
class IterationReport(TrainingReport):
    """One rollout and the update from it.

    Attributes:
        action_scale_rad: The action scale at its end.
        update: What PPO tells.
    """

    action_scale_rad: float
    update: UpdateReport

    def curve_row(self) -> dict[str, float]:
        """Its row in ``training.csv``; columns that begin with ``timing_`` are the only ones that may differ."""
        update = self.update
        return {
            "environment_steps": self.environment_steps,
            **asdict(self.episodes),
            **{f"{name}_loss": value for name, value in update.losses.items()},
            "learning_rate": update.learning_rate,
            "last_learning_rate": update.last_learning_rate,
            "action_std": update.action_std,
            "action_scale_rad": self.action_scale_rad,
            "timing_seconds": self.seconds,
            "timing_collect_seconds": update.collect_seconds,
            "timing_learn_seconds": update.learn_seconds,
        }
