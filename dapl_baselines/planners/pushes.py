"""Contact-aware proposals: touch the object where its surface must move, from the side that moves it.

For a rigid motion towards the goal every surface point has a wanted velocity; a frictionless finger helps most where
the surface faces away from it. Contacts are drawn by that score, and each becomes a small feedback controller: rise,
pass over the object, come down beside the contact, push. A rollout runs the controller and records its residuals, so a
push becomes an ordinary plan that later rounds refine.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int

from clutter6d.geometry import (
    quat_conjugate,
    quat_from_yaw,
    quat_multiply,
    quat_normalize,
    quat_to_matrix,
    rotate,
    transform_points,
)
from clutter6d.sim.robot import hand_pose
from dapl_baselines.planners.config import PushConfig
from dapl_baselines.planners.contact_points import ContactPoints
from dapl_baselines.planners.hand_servo import servo_residuals, tip_positions

_RISE, _PASS, _DESCEND, _PUSH = range(4)
_FINGERS_DOWN = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
_NEARBY_M, _ABOVE_M, _ARRIVED_M, _HEIGHT_SLACK_M = 0.05, 0.02, 0.018, 0.015
_FAR_TURN_RAD, _UPRIGHT_RAD, _ALIGNED_RAD, _OVERHEAD_RAD, _LOW_M = 1.0, 0.2, 0.06, 2.6, 0.01
_MOVE, _TIP, _TURN, _ALL = range(4)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Pushes:
    """Pushes of many rollouts; lengths in metres, world frame.

    Attributes:
        start: Tip position from which the contact is made.
        direction: Unit direction of the push.
        length: How far the tips move.
        hover: Tip height of the passage over the object.
        hand_rotation: How the hand is turned.
        approach_speed: Tip movement per control step before the push.
        push_speed: The same during the push.
        min_height: Lowest end of a push.
        phase: What each rollout is doing; changes as it goes.
        end: Where the push ends; known when it starts.
    """

    start: Float64[np.ndarray, "push 3"]
    direction: Float64[np.ndarray, "push 3"]
    length: Float64[np.ndarray, "push"]
    hover: Float64[np.ndarray, "push"]
    hand_rotation: Float64[np.ndarray, "push 3 3"]
    approach_speed: float
    push_speed: Float64[np.ndarray, "push"]
    min_height: float
    phase: Int[np.ndarray, "push"]
    end: Float64[np.ndarray, "push 3"]

    def residuals(self, arm_qpos: Float64[np.ndarray, "push 7"]) -> Float64[np.ndarray, "push 7"]:
        """Joint residuals of the next control step; advances the phases."""
        tips = tip_positions(hand_pose(arm_qpos))
        is_near = _length(self.start - tips) < _NEARBY_M
        self._advance(tips, is_near)
        raised = tips + 0.3 * (self.start - tips)
        raised[:, 2] = self.hover
        above = self.start.copy()
        above[:, 2] = self.hover
        above = np.where(is_near[:, None], self.start, above)
        options = np.stack([raised, above, self.start, self.end])
        targets = options[self.phase, np.arange(len(tips))]
        speed = np.where(self.phase == _PUSH, self.push_speed, self.approach_speed)
        return servo_residuals(arm_qpos, targets, self.hand_rotation, speed)

    def _advance(self, tips: Float64[np.ndarray, "push 3"], is_near: np.ndarray) -> None:
        phase, offset = self.phase, self.start - tips
        phase[(phase == _RISE) & ((tips[:, 2] > self.hover - _HEIGHT_SLACK_M) | is_near)] = _PASS
        phase[(phase == _PASS) & (_length(offset[:, :2]) < _ABOVE_M)] = _DESCEND
        begins = (phase != _RISE) & (phase != _PUSH) & (_length(offset) < _ARRIVED_M)
        phase[begins] = _PUSH
        self.end[begins] = tips[begins] + self.direction[begins] * self.length[begins, None]
        self.end[:, 2] = np.maximum(self.end[:, 2], self.min_height)


def draw_pushes(
    contacts: ContactPoints,
    target_pose: Float64[np.ndarray, "7"],
    goal: Float64[np.ndarray, "7"],
    count: int,
    config: PushConfig,
    rng: np.random.Generator,
) -> Pushes:
    """Draw pushes that move the target towards its goal.

    Args:
        contacts: Where the target can be touched.
        target_pose: Its pose.
        goal: Its goal pose.
        count: How many pushes.
        config: Ranges and shares.
        rng: Source of every draw.
    """
    points = transform_points(target_pose, contacts.points)
    normals = rotate(target_pose[3:], contacts.normals)
    wanted, is_tip = _wanted_motion(points, target_pose, goal, count, config, rng)
    score = _contact_scores(wanted, normals, np.where(is_tip, config.friction_cone_rad, 0.0))
    score = np.where(points[:, 2] < config.min_tip_height_m, -9.0, score)
    chosen = (score / config.score_temperature + rng.gumbel(size=score.shape)).argmax(axis=-1)
    motion, normal = wanted[np.arange(count), chosen], normals[chosen]
    direction = np.where(rng.random((count, 1)) < 0.6, motion / np.maximum(_length(motion), 1e-6)[:, None], -normal)
    direction = direction + config.direction_noise * rng.normal(size=(count, 3))
    start = points[chosen] + normal * rng.uniform(*config.standoff_m, size=(count, 1))
    start[:, 2] = np.maximum(start[:, 2], config.min_tip_height_m)
    top = points[:, 2].max() + config.hover_clearance_m
    length = np.clip(_length(motion), 0.03, config.max_push_m) * rng.uniform(0.5, 1.4, size=count)
    return Pushes(
        start=start,
        direction=direction / np.maximum(_length(direction), 1e-6)[:, None],
        length=length,
        hover=np.maximum(top, start[:, 2] + 0.01),
        hand_rotation=_draw_hand_rotations(count, config, rng),
        approach_speed=config.speed_m,
        push_speed=config.speed_m * rng.uniform(*config.push_speed_share, size=count),
        min_height=config.min_tip_height_m,
        phase=np.full(count, _RISE),
        end=start.copy(),
    )


def _contact_scores(
    wanted: Float64[np.ndarray, "push point 3"],
    normals: Float64[np.ndarray, "point 3"],
    cone_rad: Float64[np.ndarray, "push"],
) -> Float64[np.ndarray, "push point"]:
    """How much of a wanted motion a force within a cone about the inward normal can make, in [-1, 1]."""
    speed = _length(wanted)
    scale = np.maximum(speed.max(axis=-1, keepdims=True), 1e-6)
    cosine = -(normals * wanted).sum(axis=-1) / np.maximum(speed, 1e-9)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0)) - cone_rad[:, None]
    return speed / scale * np.cos(np.maximum(angle, 0.0))


def _wanted_motion(
    points: Float64[np.ndarray, "point 3"],
    target_pose: Float64[np.ndarray, "7"],
    goal: Float64[np.ndarray, "7"],
    count: int,
    config: PushConfig,
    rng: np.random.Generator,
) -> tuple[Float64[np.ndarray, "push point 3"], Bool[np.ndarray, "push"]]:
    """Displacement that every surface point should make, for each push's own intent; and which pushes tip the object.

    Tipping turns the object about the lowest edge ahead of it, turning about the vertical axis through its centre.
    """
    translation = (goal[:3] - target_pose[:3]) * np.array([1.0, 1.0, 0.0])
    tilt, twist = tilt_and_twist(target_pose[3:], goal[3:])
    angle = float(np.sqrt((tilt**2).sum()))
    shares = config.upright_shares if angle < _UPRIGHT_RAD else config.tipping_shares
    intent = rng.choice(4, size=count, p=np.array(shares))
    if angle < _UPRIGHT_RAD and abs(twist) < _ALIGNED_RAD:
        intent = np.full(count, _MOVE)
    moves, tips, turns = (((intent == kind) | (intent == _ALL))[:, None, None] for kind in (_MOVE, _TIP, _TURN))
    tilts = _spread_tilts(tilt, count, config, rng) * min(1.0, _FAR_TURN_RAD / max(angle, 1e-6))
    pivots = _pivots(points, tilts)
    tipping = np.cross(tilts[:, None], points - pivots[:, None])
    turning = np.clip(twist, -_FAR_TURN_RAD, _FAR_TURN_RAD) * np.cross([0.0, 0.0, 1.0], points - target_pose[:3])
    return moves * translation + tips * tipping + turns * turning, intent == _TIP


def _spread_tilts(
    tilt: Float64[np.ndarray, "3"], count: int, config: PushConfig, rng: np.random.Generator
) -> Float64[np.ndarray, "push 3"]:
    """The tilt, its axis turned a little about the vertical; by any angle if the object stands on its head."""
    angle = float(np.sqrt((tilt**2).sum()))
    spread = (
        np.pi * rng.uniform(-1, 1, count) if angle > _OVERHEAD_RAD else config.axis_noise_rad * rng.normal(size=count)
    )
    return rotate(quat_from_yaw(spread), tilt)


def _pivots(
    points: Float64[np.ndarray, "point 3"], tilts: Float64[np.ndarray, "push 3"]
) -> Float64[np.ndarray, "push 3"]:
    """Of the points near the table, the one furthest ahead in the direction in which each tilt carries the top."""
    ahead = np.cross(tilts, [0.0, 0.0, 1.0])
    advance = (ahead[:, None] * points).sum(axis=-1)
    is_low = points[:, 2] < points[:, 2].min() + _LOW_M
    return points[np.where(is_low, advance, -np.inf).argmax(axis=-1)]


def tilt_and_twist(
    start: Float64[np.ndarray, "4"], goal: Float64[np.ndarray, "4"]
) -> tuple[Float64[np.ndarray, "3"], float]:
    """The turn from ``start`` to ``goal`` as a turn about a horizontal axis, then one about the vertical.

    Returns:
        The horizontal rotation vector and the angle about the vertical axis [rad].
    """
    turn = quat_multiply(goal, quat_conjugate(start))
    turn = turn if turn[0] >= 0 else -turn
    upright = float(np.hypot(turn[0], turn[3]))
    twist = 2 * float(np.arctan2(turn[3], turn[0]))
    untwisted = quat_multiply(quat_from_yaw(-twist), turn)
    axis = np.array([untwisted[1], untwisted[2], 0.0])
    sine = float(np.sqrt((axis**2).sum()))
    tilt = np.zeros(3) if sine < 1e-9 else 2 * np.arctan2(sine, upright) * axis / sine
    return tilt, (twist + np.pi) % (2 * np.pi) - np.pi


def _draw_hand_rotations(count: int, config: PushConfig, rng: np.random.Generator) -> Float64[np.ndarray, "push 3 3"]:
    """Fingers down, any yaw of the flat hand, a little tilt."""
    yaw = quat_from_yaw(rng.uniform(-np.pi / 2, np.pi / 2, size=count))
    half_tilt = config.tilt_rad / 2 * rng.normal(size=(count, 2))
    tilt = quat_normalize(np.concatenate([np.ones((count, 1)), half_tilt, np.zeros((count, 1))], axis=1))
    return np.einsum("nij,jk->nik", quat_to_matrix(quat_multiply(tilt, yaw)), _FINGERS_DOWN)


def _length(vectors: Float64[np.ndarray, "*n d"]) -> Float64[np.ndarray, "*n"]:
    return np.sqrt((vectors**2).sum(axis=-1))
