"""How wrong a policy's observation is (:mod:`clutter6d.envs.observation_noise` makes it so).

Two kinds, which the paper has. Errors of the *inputs* (paper, Table "Sensitivity to noisy physical and goal inputs"):
estimates of mass, velocity and goal pose are off, by shares of their mean; bodies stay rigid and rotations valid,
since the observation is made from the wrong estimates. Errors of the *points* (paper, "Dynamics Distillation"): each
coordinate and velocity of each object's point is off on its own.
"""

from dataclasses import dataclass
from typing import Final

from clutter6d.errors import InvalidValueError, UnknownNameError

NOISY_INPUTS: Final = ("mass", "velocity", "goal_pose")
SENSITIVITY_LEVELS: Final = (0.005, 0.05, 0.25, 0.5)
"""Shares of the paper's sensitivity study."""

_MAX_SHARE: Final = 10.0


@dataclass(frozen=True, kw_only=True, slots=True)
class NoiseConfig:
    """How wrong an observation is; zero is not wrong at all.

    The paper gives "percentages of the corresponding input mean" and neither says what the mean is taken over nor how
    long an error lasts. Here, a share of 0.05 means that the root mean square of the error's length is 5% of:

    - the mean mass of the scene's objects, drawn once an episode for each object, as an estimate of a mass is wrong
      for good. An estimate is at least a tenth of the truth.
    - the mean speed of all points of the scene's objects at that moment, drawn at every step for each object, as a
      velocity from differences of poses jitters. Half of the variance is an error of the linear velocity, half one of
      the angular velocity. A scene at rest is seen at rest.
    - the distance and the angle from the episode's initial pose to its goal, drawn at every step. Were it a share of
      what remains, it would vanish at the goal. Were it drawn once an episode, 25% would put all but 2% of the goals
      that are a quarter turn away beyond the tolerance, while the paper keeps three of four successes there.

    Attributes:
        mass: Share for the masses of all objects, in the points' features and in the physics parameters.
        velocity: Share for the velocities of all objects.
        goal_pose: Share for the relative goal: translation, and rotation, which stays a rotation.
        coordinates_m: Standard deviation of every coordinate of every object's point, at every step [m].
        velocities_m_s: The same for every component of a point's velocity [m/s].
    """

    mass: float = 0.0
    velocity: float = 0.0
    goal_pose: float = 0.0
    coordinates_m: float = 0.0
    velocities_m_s: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is no share or no deviation."""
        for name in (*NOISY_INPUTS, "coordinates_m", "velocities_m_s"):
            value = getattr(self, name)
            if not 0 <= value <= _MAX_SHARE:
                raise InvalidValueError(
                    f"noise {name} is {value}; give a number in [0, {_MAX_SHARE:g}], as 0.05 for 5%"
                )

    @property
    def is_silent(self) -> bool:
        """Whether nothing is wrong."""
        return not (self.disturbs_inputs or self.disturbs_points)

    @property
    def disturbs_inputs(self) -> bool:
        """Whether the estimates that an observation is made from are wrong."""
        return max(self.mass, self.velocity, self.goal_pose) > 0

    @property
    def disturbs_points(self) -> bool:
        """Whether each point is wrong on its own."""
        return max(self.coordinates_m, self.velocities_m_s) > 0


DISTILLATION_NOISE: Final = NoiseConfig(coordinates_m=0.05, velocities_m_s=0.05)
"""What the student of the distillation sees (paper, "Dynamics Distillation": sigma 0.05)."""


def sensitivity_noise(source: str, share: float) -> NoiseConfig:
    """One cell of the paper's sensitivity study.

    Args:
        source: Which of :data:`NOISY_INPUTS` is wrong; ``all`` for the three at once.
        share: How wrong; the study has :data:`SENSITIVITY_LEVELS`.

    Raises:
        UnknownNameError: There is no such source.
        InvalidValueError: The share is out of range.
    """
    if source not in ("all", *NOISY_INPUTS):
        raise UnknownNameError("noise source", source, ("all", *NOISY_INPUTS))
    shares = {name: share for name in NOISY_INPUTS if source in (name, "all")}
    return NoiseConfig(**shares)
