"""What came of one iteration of a policy training, and its rows in the curves."""

from dataclasses import asdict, dataclass

from dapl_baselines.policy.episode_tally import EpisodeMeans
from dapl_baselines.policy.rsl_runner import UpdateReport
from dapl_baselines.validation_run import ValidationResult


@dataclass(frozen=True, kw_only=True, slots=True)
class IterationReport:
    """One rollout and the update from it.

    Attributes:
        iteration: Its number, from 1.
        environment_steps: Control steps of all environments since the beginning.
        seconds: Time of rollouts and updates since the beginning.
        action_scale_rad: The action scale at its end.
        episodes: The episodes that ended in it.
        update: What PPO tells.
        validation: The look at the validation scenes, if there was one.
    """

    iteration: int
    environment_steps: int
    seconds: float
    action_scale_rad: float
    episodes: EpisodeMeans
    update: UpdateReport
    validation: ValidationResult | None

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

    def validation_row(self) -> dict[str, float]:
        """Its row in ``validation.csv``; empty without a look."""
        if self.validation is None:
            return {}
        return {
            "environment_steps": self.environment_steps,
            **asdict(self.validation),
            "timing_seconds": self.seconds,
        }
