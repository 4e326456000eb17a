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
    quat_from_axis_angle,
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
from dapl_baselines.planners.motions import Motions, draw_motions

_RISE, _PASS, _DESCEND, _PUSH = range(4)
_FINGERS_DOWN = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
_NEARBY_M, _ABOVE_M, _ARRIVED_M, _HEIGHT_SLACK_M = 0.05, 0.02, 0.018, 0.015
_MIN_RADIUS_M = 0.02


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Pushes:
    """Pushes of many rollouts; lengths in metres, world frame.

    Attributes:
        start: Tip position from which the contact is made.
        direction: Unit direction of the push; turns while the object is tipped.
        bend: Rotation vector by which the direction turns for each metre.
        length: How far the tips move.
        hover: Tip height of the passage over the object.
        hand_rotation: How the hand is turned.
        approach_speed: Tip movement per control step before the push.
        push_speed: The same during the push.
        min_height: Lowest tip during a push.
        phase: What each rollout is doing; changes as it goes.
        travelled: How far the tips have been sent in the push; changes as it goes.
    """

    start: Float64[np.ndarray, "push 3"]
    direction: Float64[np.ndarray, "push 3"]
    bend: Float64[np.ndarray, "push 3"]
    length: Float64[np.ndarray, "push"]
    hover: Float64[np.ndarray, "push"]
    hand_rotation: Float64[np.ndarray, "push 3 3"]
    approach_speed: float
    push_speed: Float64[np.ndarray, "push"]
    min_height: float
    phase: Int[np.ndarray, "push"]
    travelled: Float64[np.ndarray, "push"]

    @property
    def is_over(self) -> Bool[np.ndarray, "push"]:
        """Which pushes have been made in full."""
        return (self.phase == _PUSH) & (self.travelled >= self.length)

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
        options = np.stack([raised, above, self.start, self._push_targets(tips)])
        targets = options[self.phase, np.arange(len(tips))]
        speed = np.where(self.phase == _PUSH, self.push_speed, self.approach_speed)
        return servo_residuals(arm_qpos, targets, self.hand_rotation, speed)

    def _advance(self, tips: Float64[np.ndarray, "push 3"], is_near: np.ndarray) -> None:
        phase, offset = self.phase, self.start - tips
        phase[(phase == _RISE) & ((tips[:, 2] > self.hover - _HEIGHT_SLACK_M) | is_near)] = _PASS
        phase[(phase == _PASS) & (_length(offset[:, :2]) < _ABOVE_M)] = _DESCEND
        phase[(phase != _RISE) & (_length(offset) < _ARRIVED_M)] = _PUSH

    def _push_targets(self, tips: Float64[np.ndarray, "push 3"]) -> Float64[np.ndarray, "push 3"]:
        """The next point of each push, ahead of the tips; where they are once it is over."""
        is_pushing = (self.phase == _PUSH) & (self.travelled < self.length)
        step = np.where(is_pushing, self.push_speed, 0.0)[:, None]
        targets = tips + step * self.direction
        targets[:, 2] = np.maximum(targets[:, 2], self.min_height)
        self.travelled[:] += step[:, 0]
        self.direction[:] = rotate(_quat_from_vector(step * self.bend), self.direction)
        return targets


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
    motions = draw_motions(points, target_pose, goal, count, config, rng)
    cone_rad = np.where(motions.tilts.any(axis=-1), config.friction_cone_rad, 0.0)
    score = _contact_scores(motions.wanted, normals, cone_rad)
    score = np.where(points[:, 2] < config.min_tip_height_m, -9.0, score)
    chosen = (score / config.score_temperature + rng.gumbel(size=score.shape)).argmax(axis=-1)
    motion, normal = motions.wanted[np.arange(count), chosen], normals[chosen]
    press = rng.random((count, 1))
    direction = (1 - press) * motion / np.maximum(_length(motion), 1e-6)[:, None] - press * normal
    direction = direction + config.direction_noise * rng.normal(size=(count, 3))
    start = points[chosen] + normal * rng.uniform(*config.standoff_m, size=(count, 1))
    start[:, 2] = np.maximum(start[:, 2], config.min_tip_height_m)
    top = points[:, 2].max() + config.hover_clearance_m
    length = np.clip(_length(motion), 0.03, config.max_push_m) * rng.uniform(0.5, 1.4, size=count)
    return Pushes(
        start=start,
        direction=direction / np.maximum(_length(direction), 1e-6)[:, None],
        bend=_bend(motions, points[chosen]),
        length=length,
        hover=np.maximum(top, start[:, 2] + 0.01),
        hand_rotation=_draw_hand_rotations(count, config, rng),
        approach_speed=config.speed_m,
        push_speed=config.speed_m * rng.uniform(*config.push_speed_share, size=count),
        min_height=config.min_tip_height_m,
        phase=np.full(count, _RISE),
        travelled=np.zeros(count),
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


def _bend(motions: Motions, contacts: Float64[np.ndarray, "push 3"]) -> Float64[np.ndarray, "push 3"]:
    """Rotation per metre of a tip that goes round the pivot with the object."""
    axis = motions.tilts / np.maximum(_length(motions.tilts), 1e-9)[:, None]
    radius = _length(np.cross(axis, contacts - motions.pivots))
    return axis / np.maximum(radius, _MIN_RADIUS_M)[:, None]


def _quat_from_vector(rotations: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "n 4"]:
    angle = _length(rotations)
    return quat_from_axis_angle(rotations / np.maximum(angle, 1e-12)[:, None], angle)


def _draw_hand_rotations(count: int, config: PushConfig, rng: np.random.Generator) -> Float64[np.ndarray, "push 3 3"]:
    """Fingers down, any yaw of the flat hand, a little tilt."""
    yaw = quat_from_yaw(rng.uniform(-np.pi / 2, np.pi / 2, size=count))
    half_tilt = config.tilt_rad / 2 * rng.normal(size=(count, 2))
    tilt = quat_normalize(np.concatenate([np.ones((count, 1)), half_tilt, np.zeros((count, 1))], axis=1))
    return np.einsum("nij,jk->nik", quat_to_matrix(quat_multiply(tilt, yaw)), _FINGERS_DOWN)


def _length(vectors: Float64[np.ndarray, "*n d"]) -> Float64[np.ndarray, "*n"]:
    return np.sqrt((vectors**2).sum(axis=-1))
