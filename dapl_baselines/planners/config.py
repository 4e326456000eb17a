"""Settings of the planner, with the reason of each default; docs/planner.md has the measurements behind them."""

from dataclasses import dataclass, field

from clutter6d.errors import InvalidValueError


@dataclass(frozen=True, kw_only=True, slots=True)
class CostConfig:
    """What a rollout costs at each control step.

    Attributes:
        position_weight_per_m: Price of distance to the goal.
        position_dead_band_m: Distance below which a position is good enough; inside the success threshold (0.05 m),
            so that what remains of the cost is spent on the rotation.
        rotation_dead_band_rad: The same for the rotation (threshold 0.1 rad). Without dead bands the planner
            polishes one error and never risks it to mend the other.
        reach_weight_per_m: Price of the distance from the finger tips to the target's surface.
        reach_free_m: Distance from the surface that is free: a finger's radius and room to turn round the object.
        disturbance_weight_per_m: Price of the mean displacement of the other objects.
        fall_penalty: Price of an object below the table top, or of a target near the edge of the table.
        edge_m: The target's centre is near the edge beyond these |x|, |y|: 8 cm and 10 cm from it.
        final_weight: The last step counts this many times: where a rollout ends matters more than the way.
    """

    position_weight_per_m: float = 4.0
    position_dead_band_m: float = 0.035
    rotation_dead_band_rad: float = 0.07
    reach_weight_per_m: float = 0.5
    reach_free_m: float = 0.03
    disturbance_weight_per_m: float = 0.5
    fall_penalty: float = 5.0
    edge_m: tuple[float, float] = (0.42, 0.60)
    final_weight: float = 4.0


@dataclass(frozen=True, kw_only=True, slots=True)
class PushConfig:
    """How contact-aware proposals are drawn: hover, descend beside the object, push.

    Attributes:
        speed_m: Tip movement per control step while approaching; the action mapping allows the hand 0.05 m.
        push_speed_share: Range of the push's speed as a share of ``speed_m``.
        upright_shares: Shares of pushes meant to move, to tip, to turn about the vertical, to do all at once, for an
            object that rests on the right face.
        tipping_shares: The same for one that does not.
        axis_noise_rad: Standard deviation of the tipping axis' direction.
        friction_cone_rad: Half-angle of the cone in which a finger's force counts when tipping; below the fingers'
            friction cone (45 degrees), so that an end face can be dragged up.
        score_temperature: Softness of the choice of a contact; scores lie in [-1, 1].
        standoff_m: Range of the distance from which a contact is approached along its normal.
        hover_clearance_m: Height of the passage above the object's top.
        min_tip_height_m: Lowest tip above the table.
        max_push_m: Longest push.
        tilt_rad: Standard deviation of the hand's tilt about both horizontal axes.
        direction_noise: Standard deviation of the noise on a push's direction (a unit vector).
    """

    speed_m: float = 0.05
    push_speed_share: tuple[float, float] = (0.3, 1.0)
    upright_shares: tuple[float, float, float, float] = (0.35, 0.0, 0.25, 0.40)
    tipping_shares: tuple[float, float, float, float] = (0.20, 0.50, 0.05, 0.25)
    axis_noise_rad: float = 0.3
    friction_cone_rad: float = 0.6
    score_temperature: float = 0.15
    standoff_m: tuple[float, float] = (0.02, 0.06)
    hover_clearance_m: float = 0.04
    min_tip_height_m: float = 0.012
    max_push_m: float = 0.40
    tilt_rad: float = 0.25
    direction_noise: float = 0.15


@dataclass(frozen=True, kw_only=True, slots=True)
class PlannerConfig:
    """Sampling-based predictive control, run ahead in a copy of the scene.

    Attributes:
        samples: Rollouts per round.
        horizon_steps: Control steps of a rollout: 2.4 s, time to rise, change sides, come down and push.
        commit_steps: Control steps kept of a round's best rollout.
        knots: Knots of the linear splines of noise over the horizon.
        push_share: Share of rollouts that follow a contact-aware push.
        noise_rad: Standard deviation of the residuals' noise.
        noise_scales: Each noisy rollout draws one of these factors: fine polish to bold moves.
        fresh_share: Share of noisy rollouts that start from no plan at all.
        rotation_weights_per_rad: Price of the rotation error; attempt ``i`` takes entry ``i`` modulo the length.
        attempts: Plans tried from the same state, each with its own random numbers, before the best one is accepted.
        patience_steps: An attempt that has not improved for so many control steps is given up.
        improvement: Fall of the goal cost that counts as an improvement.
        max_rounds: Rounds an episode may spend in all; stops by count, never by time.
        follow_position_m: A state whose objects are within this of the predicted ones is still on the plan.
        follow_angle_rad: The same for rotations of objects and for the arm's joints.
        cost: What a rollout costs.
        push: How pushes are proposed.
    """

    samples: int = 32
    horizon_steps: int = 24
    commit_steps: int = 6
    knots: int = 6
    push_share: float = 0.5
    noise_rad: float = 0.06
    noise_scales: tuple[float, ...] = (0.15, 0.4, 1.0, 2.0)
    fresh_share: float = 0.15
    rotation_weights_per_rad: tuple[float, ...] = (0.8, 1.6)
    attempts: int = 4
    patience_steps: int = 60
    improvement: float = 0.02
    max_rounds: int = 90
    follow_position_m: float = 0.005
    follow_angle_rad: float = 0.05
    cost: CostConfig = field(default_factory=CostConfig)
    push: PushConfig = field(default_factory=PushConfig)

    def __post_init__(self) -> None:
        """Refuse settings with which no round can run."""
        if self.samples - self.pushes < 2:
            raise InvalidValueError(
                f"{self.samples} samples with a push share of {self.push_share} leave no noisy rollouts"
            )
        if not 1 <= self.commit_steps < self.horizon_steps:
            raise InvalidValueError(
                f"commit_steps {self.commit_steps} is not in [1, horizon_steps {self.horizon_steps})"
            )
        if self.knots < 2 or self.attempts < 1 or not self.rotation_weights_per_rad:
            raise InvalidValueError("the planner needs 2 knots, 1 attempt and 1 rotation weight, or more")

    @property
    def pushes(self) -> int:
        """Rollouts of a round that follow a push."""
        return int(self.push_share * self.samples)
