"""How the largest joint residual shrinks while a policy learns (paper, "Safe and Conservative Action Mapping")."""

from dataclasses import dataclass

from clutter6d.errors import InvalidValueError


@dataclass(frozen=True, kw_only=True, slots=True)
class ActionScaleCurriculum:
    """A geometric decay: every tenth of the way takes off the same share of the scale.

    The paper gives both ends and not the way between them. In a geometric decay, as many steps lead from 0.1 to 0.05
    as from 0.02 to 0.01; in a straight line, nine tenths of the training would be spent above 0.019 rad.

    Attributes:
        start_rad: Largest residual at first.
        end_rad: Largest residual from the last step on.
        steps: Control steps of training, of each environment, from one to the other.
    """

    steps: int
    start_rad: float = 0.1
    end_rad: float = 0.01

    def __post_init__(self) -> None:
        """Refuse a scale that grows, and a way without steps."""
        if not 0 < self.end_rad <= self.start_rad <= 0.5:
            raise InvalidValueError(
                f"action scale {self.start_rad} to {self.end_rad} rad does not fall within (0, 0.5]"
            )
        if self.steps < 1:
            raise InvalidValueError(f"the action scale falls in {self.steps} steps; it takes at least 1")

    def at(self, step: int) -> float:
        """The largest residual at a step of training [rad]; the last one for all later steps."""
        if step >= self.steps:
            return self.end_rad
        return self.start_rad * (self.end_rad / self.start_rad) ** (max(step, 0) / self.steps)
