"""Drawing whole pushes, by the planner's proposals: contact, direction and hand that suit a motion towards the goal.

As :mod:`dapl_baselines.planners.pushes`, for many states at once, and with two differences that looking at contacts
taught: the hand's long side lies across the push, and the hand is tilted back, so that its palm, 20 cm wide and only
4.6 cm above the finger tips, stays behind them.
"""

from math import acos, atan2, cos, exp, pi, sin, sqrt
from typing import Final, no_type_check

import numpy as np
from jaxtyping import Bool, Float, Float64

from clutter6d.envs.point_kernel import compiled
from clutter6d.geometry import quat_from_axis_angle, quat_from_yaw, quat_multiply
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.reach import lean_to_reach

MOVE, TIP, TURN, ALL = range(4)
UPRIGHT_RAD: Final = 0.2
ALIGNED_RAD: Final = 0.06
OVERHEAD_RAD: Final = 2.6
FAR_TURN_RAD: Final = 1.0
LOW_M: Final = 0.01
FRICTION_CONE_RAD: Final = 0.6
TEMPERATURE: Final = 0.15
AXIS_NOISE_RAD: Final = 0.3
DIRECTION_NOISE: Final = 0.15
"""As :class:`dapl_baselines.planners.config.PushConfig` and :mod:`dapl_baselines.planners.motions` have them."""

MOVE_SHARES: Final = (0.35, 0.35, 0.60)
TIP_SHARES: Final = (0.20, 0.70, 0.75)
"""Shares, summed up, of pushes meant to move, to tip and to turn; the rest does all at once. The first for an object on
the right face, the second for one that must be tipped."""
LOWEST_CONTACT_M: Final = 0.012
"""Of an object that is lower than twice this, contacts are above half its height."""
LOWEST_START_M: Final = 0.015
STANDOFF_M: Final = 0.05
LENGTH_M: Final = (0.02, 0.20)
SPEED_M: Final = (0.012, 0.030)
MAX_TILT_RAD: Final = 0.8
YAW_NOISE_RAD: Final = 0.25


def draw_whole_pushes(
    poses: Float[np.ndarray, "row 7"],
    goals: Float[np.ndarray, "row 7"],
    points: Float64[np.ndarray, "row point 3"],
    normals: Float64[np.ndarray, "row point 3"],
    count: int,
    rng: np.random.Generator,
) -> Float64[np.ndarray, "row push column"]:
    """Pushes of each state.

    Args:
        poses: The targets' poses.
        goals: Where they shall go.
        points: Contact points of the targets, in world axes, from their origins [m].
        normals: Outward unit normals there, in world axes.
        count: Pushes of a state.
        rng: Where they are drawn from.
    """
    shape = len(poses), count
    chosen, wanted = np.zeros(shape, dtype=np.int64), np.zeros((*shape, 3))
    arrays = [np.ascontiguousarray(array, dtype=np.float64) for array in (poses, goals, points, normals)]
    _draw(*arrays, rng.random((*shape, 3)), rng.standard_normal(shape), chosen, wanted)
    row = np.arange(len(poses))[:, None]
    contact, normal = arrays[2][row, chosen], arrays[3][row, chosen]
    press = rng.random((*shape, 1))
    direction = (1 - press) * _unit(wanted) - press * normal + DIRECTION_NOISE * rng.normal(size=(*shape, 3))
    pushes = np.zeros((*shape, columns.SIZE))
    pushes[..., columns.CONTACT], pushes[..., columns.NORMAL] = contact, normal
    pushes[..., columns.DIRECTION] = _unit(direction)
    start = contact + STANDOFF_M * normal
    height = arrays[0][:, None, 2]
    start[..., 2] = np.maximum(start[..., 2], np.minimum(LOWEST_START_M - height, contact[..., 2]))
    pushes[..., columns.START] = start
    pushes[..., columns.LENGTH] = rng.uniform(*LENGTH_M, shape)
    pushes[..., columns.SPEED] = rng.uniform(*SPEED_M, shape)
    tips, hands = start + arrays[0][:, None, :3], _draw_hands(normal, pushes[..., columns.DIRECTION], rng)
    leant, is_reached = lean_to_reach(tips.reshape(-1, 3), hands.reshape(-1, 4))
    pushes[..., columns.HAND] = leant.reshape(hands.shape)
    return _only(pushes, is_reached.reshape(shape))


def _only(
    pushes: Float64[np.ndarray, "row push column"], is_possible: Bool[np.ndarray, "row push"]
) -> Float64[np.ndarray, "row push column"]:
    """Possible pushes in the places of the others, by turns; where none is possible, all as they are."""
    possible = is_possible.sum(axis=1, keepdims=True)
    order = np.argsort(~is_possible, axis=1, kind="stable")
    turns = np.arange(pushes.shape[1]) % np.where(possible > 0, possible, pushes.shape[1])
    return np.take_along_axis(pushes, np.take_along_axis(order, turns, axis=1)[..., None], axis=1)


def _draw_hands(
    normals: Float64[np.ndarray, "row push 3"], directions: Float64[np.ndarray, "row push 3"], rng: np.random.Generator
) -> Float64[np.ndarray, "row push 4"]:
    """A turn about the vertical that lays the palm across the push, then a tilt that takes it back."""
    forward = 0.5 * directions[..., :2] - normals[..., :2]
    length = np.sqrt((forward**2).sum(axis=-1, keepdims=True))
    forward = np.where(length < 0.05, [1.0, 0.0], forward / np.maximum(length, 1e-9))
    # The hand is its own mirror image: half a turn changes nothing but the joints' angles.
    yaw = (np.arctan2(forward[..., 1], forward[..., 0]) + np.pi / 2) % np.pi - np.pi / 2
    yaw += YAW_NOISE_RAD * rng.normal(size=yaw.shape)
    tilt = rng.uniform(0.0, MAX_TILT_RAD, yaw.shape)
    across = np.stack([forward[..., 1], -forward[..., 0], np.zeros_like(yaw)], axis=-1)
    return quat_multiply(quat_from_axis_angle(across, tilt), quat_from_yaw(yaw))


def _unit(vectors: Float64[np.ndarray, "*n 3"]) -> Float64[np.ndarray, "*n 3"]:
    return vectors / np.maximum(np.sqrt((vectors**2).sum(axis=-1, keepdims=True)), 1e-6)


@compiled
@no_type_check  # the compiler is the checker
def _draw(
    poses: np.ndarray,
    goals: np.ndarray,
    points: np.ndarray,
    normals: np.ndarray,
    uniforms: np.ndarray,
    gaussians: np.ndarray,
    chosen: np.ndarray,
    motions: np.ndarray,
) -> None:
    """Draw the contact of each push, and the motion that it is meant to give the contact."""
    wanted, weights = np.empty((points.shape[1], 3)), np.empty(points.shape[1])
    for row in range(len(poses)):
        tilt_x, tilt_y, twist = _tilt_and_twist(poses[row, 3:], goals[row, 3:])
        tilt = sqrt(tilt_x**2 + tilt_y**2)
        way_x, way_y = goals[row, 0] - poses[row, 0], goals[row, 1] - poses[row, 1]
        lowest, shrink = points[row, :, 2].min(), min(1.0, FAR_TURN_RAD / max(tilt, 1e-6))
        top = points[row, :, 2].max() + poses[row, 2]
        lowest_contact = min(LOWEST_CONTACT_M, top / 2) - poses[row, 2]
        turn = min(FAR_TURN_RAD, max(-FAR_TURN_RAD, twist))
        for index in range(uniforms.shape[1]):
            kind, axis, choice = uniforms[row, index]
            intent = _intent(kind, tilt, twist)
            spread = pi * (2 * axis - 1) if tilt > OVERHEAD_RAD else AXIS_NOISE_RAD * gaussians[row, index]
            axis_x = (cos(spread) * tilt_x - sin(spread) * tilt_y) * shrink
            axis_y = (sin(spread) * tilt_x + cos(spread) * tilt_y) * shrink
            pivot = points[row, _pivot(points[row], axis_x, axis_y, lowest)]
            moves, tips, turns = intent in (MOVE, ALL), intent in (TIP, ALL), intent in (TURN, ALL)
            for i in range(points.shape[1]):
                x, y = points[row, i, 0], points[row, i, 1]
                dx, dy, dz = x - pivot[0], y - pivot[1], points[row, i, 2] - pivot[2]
                wanted[i, 0] = moves * way_x + tips * axis_y * dz - turns * turn * y
                wanted[i, 1] = moves * way_y - tips * axis_x * dz + turns * turn * x
                wanted[i, 2] = tips * (axis_x * dy - axis_y * dx)
            cone = FRICTION_CONE_RAD if intent == TIP and tilt > 1e-9 else 0.0
            _weigh(points[row], normals[row], wanted, cone, lowest_contact, weights)
            contact = _choose(weights, choice)
            chosen[row, index], motions[row, index] = contact, wanted[contact]


@compiled
@no_type_check
def _tilt_and_twist(start: np.ndarray, goal: np.ndarray) -> tuple[float, float, float]:
    """As :func:`dapl_baselines.planners.motions.tilt_and_twist`, the tilt's two horizontal components first."""
    w = goal[0] * start[0] + goal[1] * start[1] + goal[2] * start[2] + goal[3] * start[3]
    x = -goal[0] * start[1] + goal[1] * start[0] - goal[2] * start[3] + goal[3] * start[2]
    y = -goal[0] * start[2] + goal[1] * start[3] + goal[2] * start[0] - goal[3] * start[1]
    z = -goal[0] * start[3] - goal[1] * start[2] + goal[2] * start[1] + goal[3] * start[0]
    if w < 0:
        w, x, y, z = -w, -x, -y, -z
    upright, twist = sqrt(w * w + z * z), 2 * atan2(z, w)
    c, s = cos(twist / 2), sin(twist / 2)
    # The horizontal axis of what is left when the twist is taken back.
    axis_x, axis_y = c * x + s * y, c * y - s * x
    sine = sqrt(axis_x**2 + axis_y**2)
    scale = 2 * atan2(sine, upright) / sine if sine > 1e-9 else 0.0
    return scale * axis_x, scale * axis_y, (twist + pi) % (2 * pi) - pi


@compiled
@no_type_check
def _intent(uniform: float, tilt: float, twist: float) -> int:
    is_upright = tilt < UPRIGHT_RAD
    if is_upright and abs(twist) < ALIGNED_RAD:
        return MOVE
    intent = MOVE
    for share in MOVE_SHARES if is_upright else TIP_SHARES:
        if uniform > share:
            intent += 1
    return intent


@compiled
@no_type_check
def _pivot(points: np.ndarray, axis_x: float, axis_y: float, lowest: float) -> int:
    """Of the points near the table, the one furthest ahead in the direction in which the tilt carries the top."""
    best, pivot = -np.inf, 0
    for i in range(len(points)):
        advance = axis_y * points[i, 0] - axis_x * points[i, 1]
        if points[i, 2] < lowest + LOW_M and advance > best:
            best, pivot = advance, i
    return pivot


@compiled
@no_type_check
def _weigh(
    points: np.ndarray, normals: np.ndarray, wanted: np.ndarray, cone: float, lowest: float, weights: np.ndarray
) -> None:
    """Weights that a contact is drawn by: how well a finger can give each point its motion."""
    largest = 1e-6
    for i in range(len(points)):
        weights[i] = sqrt(wanted[i, 0] ** 2 + wanted[i, 1] ** 2 + wanted[i, 2] ** 2)
        largest = max(largest, weights[i])
    for i in range(len(points)):
        along = -(normals[i, 0] * wanted[i, 0] + normals[i, 1] * wanted[i, 1] + normals[i, 2] * wanted[i, 2])
        angle = acos(min(1.0, max(-1.0, along / max(weights[i], 1e-9)))) - cone
        score = weights[i] / largest * cos(max(angle, 0.0))
        weights[i] = exp((score - 1) / TEMPERATURE) if points[i, 2] > lowest else 0.0


@compiled
@no_type_check
def _choose(weights: np.ndarray, uniform: float) -> int:
    threshold, summed = uniform * weights.sum(), 0.0
    for i in range(len(weights)):
        summed += weights[i]
        if weights[i] > 0 and summed >= threshold:
            return i
    return 0
