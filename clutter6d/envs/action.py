"""From a policy's joint residuals to joint targets (paper, "Safe and Conservative Action Mapping").

Pure functions, row by row: a row's result is the same to the bit wherever it stands in a batch. Every product is
therefore written out term by term; a matrix library sums in an order that depends on the batch's shape. Arrays are
NumPy's or torch's (:mod:`clutter6d.arrays`).
"""

from dataclasses import dataclass, replace
from typing import Literal

from jaxtyping import Float

from clutter6d.arrays import Array, constant, namespace
from clutter6d.envs.action_scale import ActionScaleCurriculum
from clutter6d.errors import InvalidValueError
from clutter6d.sim.robot import JOINT_LOWER_RAD, JOINT_UPPER_RAD, hand_jacobian

ACTION_SIZE = 7
_LOWER_RAD = tuple(JOINT_LOWER_RAD.tolist())
_UPPER_RAD = tuple(JOINT_UPPER_RAD.tolist())


@dataclass(frozen=True, kw_only=True, slots=True)
class ActionConfig:
    """How residuals become targets.

    Attributes:
        action_scale_rad: Largest residual of a joint in one control step; the curriculum's first value.
        max_hand_step_m: The paper's bound on the hand's commanded movement in one control step, whose value it does
            not give. 0.05 m in 0.1 s is the success threshold: an object pushed by the hand cannot pass through its
            goal between two looks, and in 300 steps the hand still travels 15 m.
        damping: The paper's damping (m/rad) of the pseudo-inverse, whose value it does not give either. The hand's
            Jacobian has singular values of 0.2 to 1.1 m/rad in the workspace: 0.05 leaves at most 6% of an excess in
            place there, and keeps the correction bounded near a singularity.
        control: What an action is: ``"joint"``: residuals of the joints; ``"cartesian"``: a movement of the hand
            (:mod:`clutter6d.envs.control_mode`).
        cartesian_damping: Damping of the pseudo-inverse that turns a movement of the hand into residuals. The whole
            Jacobian's smallest singular value has a median of 0.17 over the table, where 0.02 changes a movement by 1%.
        posture_pull: Pull towards the home posture in the null space: the share of the way that is left, for each
            metre or radian that the hand moves.
        curriculum: How the action scale falls in training; ``None``: it stays.
    """

    action_scale_rad: float = 0.1
    max_hand_step_m: float = 0.05
    damping: float = 0.05
    control: Literal["joint", "cartesian"] = "joint"
    cartesian_damping: float = 0.02
    posture_pull: float = 2.0
    curriculum: ActionScaleCurriculum | None = None

    def __post_init__(self) -> None:
        """Refuse values that no arm can follow."""
        if not 0 < self.action_scale_rad <= 0.5:
            raise InvalidValueError(f"action scale {self.action_scale_rad} rad is not in (0, 0.5]")
        if not (self.max_hand_step_m > 0 and self.damping > 0 and self.cartesian_damping > 0):
            raise InvalidValueError("the bound on the hand's step and the dampings must be positive")
        if self.control not in ("joint", "cartesian"):
            raise InvalidValueError(f"control {self.control!r} is neither 'joint' nor 'cartesian'")
        if not self.posture_pull >= 0:
            raise InvalidValueError(f"posture pull {self.posture_pull} is negative")

    def at(self, step: int) -> "ActionConfig":
        """The mapping at a control step of training: with the curriculum's action scale, if there is one."""
        return self if self.curriculum is None else replace(self, action_scale_rad=self.curriculum.at(step))


def joint_targets(
    actions: Float[Array, "slot 7"],
    arm_qpos: Float[Array, "slot 7"],
    config: ActionConfig,
    *,
    jacobian: Float[Array, "slot 6 7"] | None = None,
) -> Float[Array, "slot 7"]:
    """Joint angles to drive to: current angles plus the clipped residuals, within the joint limits [rad].

    Args:
        actions: Joint residuals [rad], as the policy gave them.
        arm_qpos: Current joint angles [rad].
        config: Scale and bounds.
        jacobian: The hand's at ``arm_qpos``, if it is known already.
    """
    xp, scale = namespace(arm_qpos), config.action_scale_rad
    residuals = xp.minimum(xp.maximum(xp.astype(actions, arm_qpos.dtype), -scale), scale)
    known = hand_jacobian(arm_qpos) if jacobian is None else jacobian
    residuals = clip_hand_step(residuals, known[:, :3], config)
    return within_joint_limits(arm_qpos + residuals)


def within_joint_limits(qpos: Float[Array, "slot 7"]) -> Float[Array, "slot 7"]:
    """The nearest joint angles that the arm allows [rad]."""
    xp = namespace(qpos)
    return xp.minimum(xp.maximum(qpos, constant(_LOWER_RAD, qpos)), constant(_UPPER_RAD, qpos))


def clip_hand_step(
    residuals: Float[Array, "slot 7"], jacobian: Float[Array, "slot 3 7"], config: ActionConfig
) -> Float[Array, "slot 7"]:
    """Take out of each residual what would move the hand further than ``max_hand_step_m``.

    The excess of the hand's movement, ``dx (1 - bound / |dx|)``, is mapped back with the damped pseudo-inverse,
    ``J^T (J J^T + damping^2 I)^-1`` (paper, "Cartesian-space Action Clipping"). Rows within the bound pass unchanged
    to the bit; corrected rows are rounded to float32, so that the last bits of a sine, which differ between machines,
    do not reach the simulation.
    """
    xp = namespace(residuals)
    step = joint_to_hand_velocity(jacobian, residuals)
    length = xp.sqrt(_dot(step, step))
    is_over = length > config.max_hand_step_m
    share = 1 - config.max_hand_step_m / xp.where(is_over, length, 1.0)
    weights = _solve_damped(jacobian, step * share[:, None], config.damping)
    excess = joint_to_hand_velocity(xp.matrix_transpose(jacobian), weights)
    corrected = xp.astype(xp.astype(residuals - excess, xp.float32), residuals.dtype)
    return xp.where(is_over[:, None], corrected, residuals)


def joint_to_hand_velocity(
    jacobian: Float[Array, "slot axis joint"], arm_qvel: Float[Array, "slot joint"]
) -> Float[Array, "slot axis"]:
    """The hand's velocity, ``J dq``, in the rows of the Jacobian."""
    rows = [_dot(jacobian[:, axis], arm_qvel) for axis in range(jacobian.shape[1])]
    return namespace(arm_qvel).stack(rows, axis=1)


def _dot(a: Float[Array, "slot n"], b: Float[Array, "slot n"]) -> Float[Array, "slot"]:
    """Row-wise dot product, summed from left to right."""
    total = a[:, 0] * b[:, 0]
    for column in range(1, a.shape[1]):
        total = total + a[:, column] * b[:, column]
    return total


def _solve_damped(
    jacobian: Float[Array, "slot 3 7"], right: Float[Array, "slot 3"], damping: float
) -> Float[Array, "slot 3"]:
    """Solve ``(J J^T + damping^2 I) w = right`` row by row, by cofactors; the matrix is symmetric positive definite."""
    rows = [jacobian[:, axis] for axis in range(3)]
    a, d, f = (_dot(row, row) + damping**2 for row in rows)
    b, c, e = _dot(rows[0], rows[1]), _dot(rows[0], rows[2]), _dot(rows[1], rows[2])
    aa, ab, ac = d * f - e * e, c * e - b * f, b * e - c * d
    bb, bc, cc = a * f - c * c, b * c - a * e, a * d - b * b
    determinant = a * aa + b * ab + c * ac
    x, y, z = (right[:, axis] for axis in range(3))
    solution = [aa * x + ab * y + ac * z, ab * x + bb * y + bc * z, ac * x + bc * y + cc * z]
    return namespace(right).stack([component / determinant for component in solution], axis=1)
