"""What came of one iteration of a distillation, and its rows in the curves."""

from dataclasses import asdict, dataclass

from dapl_baselines.distillation.student import DistillationLosses
from dapl_baselines.policy.episode_tally import EpisodeMeans
from dapl_baselines.validation_run import ValidationResult


@dataclass(frozen=True, kw_only=True, slots=True)
class DistillationReport:
    """One rollout and what was learned after it.

    Attributes:
        iteration: Its number, from 1.
        environment_steps: Control steps of all environments since the beginning.
        seconds: Time of rollouts and updates since the beginning.
        teacher_share: Share of the environments that the teacher acted in.
        episodes: The episodes that ended in it.
        losses: Means over the updates.
        validation: The look at the validation scenes, if there was one.
    """

    iteration: int
    environment_steps: int
    seconds: float
    teacher_share: float
    episodes: EpisodeMeans
    losses: DistillationLosses
    validation: ValidationResult | None

    def curve_row(self) -> dict[str, float]:
        """Its row in ``training.csv``; columns that begin with ``timing_`` are the only ones that may differ."""
        return {
            "environment_steps": self.environment_steps,
            **asdict(self.episodes),
            **{f"{name}_loss": value for name, value in asdict(self.losses).items()},
            "teacher_share": self.teacher_share,
            "timing_seconds": self.seconds,
        }

    def validation_row(self) -> dict[str, float]:
        """Its row in ``validation.csv``; empty without a look."""
        if self.validation is None:
            return {}
        steps = {"environment_steps": self.environment_steps}
        return {**steps, **asdict(self.validation), "timing_seconds": self.seconds}
