"""Pushes and states as a network sees them: from the contact, along the push.

Physics does not know of north, and a contact does not know where on the table it is. So everything is told in the frame
of the push: origin at the contact, x along its horizontal part, z up. Numbers are scaled to the size of 1.
"""

from dataclasses import dataclass
from typing import Final

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from clutter6d.geometry import quat_conjugate, quat_multiply, quat_to_matrix
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.push_state import PushState

ROBOT_BASE_M: Final = (-0.6, 0.0, 0.0)
LOW_M: Final = 0.012
"""Points within this of the lowest one carry the target."""
POINT_FEATURES: Final = 7
OBSTACLE_FEATURES: Final = 6
_OTHER_FEATURES: Final = 77
_EPSILON: Final = 1e-6


def feature_count(obstacles: int) -> int:
    """Numbers that a push and its state are described by, beside surface points."""
    return _OTHER_FEATURES + OBSTACLE_FEATURES * obstacles


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PushView:
    """What the network sees of pushes.

    Attributes:
        features: Of each push in its state.
        points: Surface points of the target: place from the contact, way to the goal, height above the table.
    """

    features: Float[Tensor, "row push feature"]
    points: Float[Tensor, "row push point 7"]


def push_axes(pushes: Float[Tensor, "*n column"]) -> Float[Tensor, "*n 3 3"]:
    """The axes of the pushes' frames, as rows: the matrix takes vectors from world axes into the frame."""
    forward = pushes[..., columns.DIRECTION][..., :2] - 0.5 * pushes[..., columns.NORMAL][..., :2]
    x, y = (forward / torch.linalg.vector_norm(forward, dim=-1, keepdim=True).clamp(min=1e-4)).unbind(-1)
    zero, one = torch.zeros_like(x), torch.ones_like(x)
    return torch.stack([x, y, zero, -y, x, zero, zero, zero, one], dim=-1).unflatten(-1, (3, 3))


def view_pushes(
    state: PushState[Tensor],
    goals: Float[Tensor, "row 7"],
    surface: Float[Tensor, "row point 3"],
    pushes: Float[Tensor, "row push column"],
) -> PushView:
    """What the network sees.

    Args:
        state: Where things are; as float32 tensors.
        goals: Where the targets shall go.
        surface: Surface points of the targets, in their own frames [m].
        pushes: Rows of :mod:`dapl_baselines.push_policy.push`.
    """
    frame = _Frame(state, goals, surface, pushes)
    return PushView(features=frame.features(), points=frame.points())


class _Frame:
    """The quantities that several features are made of; ``here`` means in the frame of the push."""

    def __init__(
        self,
        state: PushState[Tensor],
        goals: Float[Tensor, "row 7"],
        surface: Float[Tensor, "row point 3"],
        pushes: Float[Tensor, "row push column"],
    ) -> None:
        self.state, self.goals, self.pushes = state, goals, pushes
        self.axes = push_axes(pushes)
        self.contact, self.normal = pushes[..., columns.CONTACT], pushes[..., columns.NORMAL]
        self.direction, self.start = pushes[..., columns.DIRECTION], pushes[..., columns.START]
        self.length = pushes[..., columns.LENGTH, None]
        self.way = (goals[:, :3] - state.poses[:, :3])[:, None]
        self.rotation, self.goal_rotation = quat_to_matrix(state.poses[:, 3:]), quat_to_matrix(goals[:, 3:])
        self.placed = surface @ self.rotation.mT
        self.flow = surface @ self.goal_rotation.mT - self.placed + self.way
        self.height = state.poses[:, None, 2:3].expand_as(self.length)

    def points(self) -> Float[Tensor, "row push point 7"]:
        """Of the target's surface."""
        here = (self.placed[:, None] - self.contact[:, :, None]) @ self.axes.mT
        flow = (self.flow[:, None] @ self.axes.mT).clamp(-0.5, 0.5)
        heights = (self.placed[..., 2:] + self.state.poses[:, None, 2:3])[:, None].expand(*here.shape[:-1], 1)
        return torch.cat([10 * here, 5 * flow, 10 * heights], dim=-1)

    def features(self) -> Float[Tensor, "row push feature"]:
        """All of them."""
        parts = [*self._push(), *self._support(), *self._goal(), *self._surroundings(), *self._motion()]
        return torch.cat([part.expand(*self.length.shape[:2], -1) for part in parts], dim=-1)

    def here(self, vectors: Float[Tensor, "row *push 3"]) -> Float[Tensor, "row push 3"]:
        """Vectors of world axes, in the frame."""
        return (self.axes @ vectors[..., None])[..., 0]

    def _push(self) -> list[Tensor]:
        standoff, hand = self.start - self.contact, quat_to_matrix(self.pushes[..., columns.HAND])
        across = self.here(hand[..., :, 0])
        # A hand turned by half a turn about its own axis is the same hand.
        doubled = [across[..., :1] ** 2 - across[..., 1:2] ** 2, 2 * across[..., :1] * across[..., 1:2]]
        return [
            self.here(self.normal),
            self.here(self.direction),
            20 * torch.linalg.vector_norm(standoff, dim=-1, keepdim=True),
            20 * (standoff * self.normal).sum(-1, keepdim=True),
            20 * (standoff * self.direction).sum(-1, keepdim=True),
            5 * self.length,
            60 * (self.pushes[..., columns.SPEED, None] - 0.02),
            self.pushes[..., columns.IS_SEGMENT, None],
            *doubled,
            self.here(hand[..., :, 2]),
        ]

    def _support(self) -> list[Tensor]:
        """Where the target's centre and the edges that carry it lie: what decides whether it slides or tips."""
        centre, top = -self.contact, self.placed[..., 2].amax(1)[:, None, None] + self.height
        is_low = (self.placed[..., 2] < self.placed[..., 2].amin(1, keepdim=True) + LOW_M)[:, None]
        offsets = (self.placed[:, None] - self.contact[:, :, None]) @ self.axes.mT
        ahead, behind = _extent(offsets[..., 0], is_low)
        left, right = _extent(offsets[..., 1], is_low)
        contact_height, lever = self.contact[..., 2:] + self.height, ahead.clamp(min=0.01)
        return [
            10 * torch.cat([self.here(centre), contact_height, top, self.height, ahead, behind, left, right], dim=-1),
            0.5 * torch.cat([contact_height / lever, self.height / lever], dim=-1).clamp(max=5),
        ]

    def _goal(self) -> list[Tensor]:
        turn = quat_multiply(self.goals[:, 3:], quat_conjugate(self.state.poses[:, 3:]))
        tilt, twist = _tilt_and_twist(turn)
        twist, tilt = twist[:, None, None], tilt[:, None]
        tilted = torch.linalg.vector_norm(tilt, dim=-1, keepdim=True)
        turned = 2 * torch.acos(turn[:, :1].abs().clamp(max=1 - 1e-7))[:, None]
        distance, ahead = torch.linalg.vector_norm(self.way, dim=-1, keepdim=True), self.here(self.way)
        local = self.contact @ self.rotation
        flow = local @ self.goal_rotation.mT - self.contact + self.way
        torque = torch.linalg.cross(self.contact, self.direction)[..., 2:]
        push = self.here(self.direction)[..., :1] * self.length
        return [
            4 * ahead.clamp(-0.6, 0.6),
            self.here(tilt),
            *(twist.sin(), twist.cos(), twist, tilted, turned, 4 * distance),
            *((distance < 0.05).float(), (turned < 0.1).float(), (tilted < 0.2).float()),
            *((20 * distance).clamp(max=2), (10 * turned).clamp(max=2)),
            5 * self.here(flow),
            *(20 * torque, 20 * torque * twist, (60 * torque * self.length - twist).clamp(-3, 3)),
            5 * (ahead[..., :1] - push),
        ]

    def _surroundings(self) -> list[Tensor]:
        around, start = self.state.obstacles[:, None], self.state.poses[:, None, :3] + self.start
        offsets = around[..., :3] - (self.state.poses[:, None, :3] + self.contact)[:, :, None]
        gaps = torch.linalg.vector_norm(offsets, dim=-1, keepdim=True) - around[..., 3:4]
        others = around[..., 3:].expand(*offsets.shape[:-1], 2)
        radius, mass = 5 * others[..., :1], 0.5 * others[..., 1:].clamp(min=1e-3).log()
        obstacles = torch.cat([4 * offsets @ self.axes.mT, radius, mass, 4 * gaps], dim=-1)
        nearest_first = gaps.argsort(dim=2).expand_as(obstacles)
        base = start.new_tensor(ROBOT_BASE_M) - start
        return [
            obstacles.gather(2, nearest_first).flatten(2),
            1.5 * self.here(base)[..., :2],
            2 * torch.linalg.vector_norm(base[..., :2], dim=-1, keepdim=True),
            2 * start[..., :2],
            3 * torch.cat([self.state.poses[:, None, :2], self.goals[:, None, :2]], dim=-1),
        ]

    def _motion(self) -> list[Tensor]:
        to_tips = self.state.tips[:, None] - self.state.poses[:, None, :3] - self.start
        linear, angular = self.state.velocities[:, None].split(3, dim=-1)
        mass, friction = self.state.physics[:, None].split(1, dim=-1)
        return [
            3 * self.here(to_tips),
            3 * torch.linalg.vector_norm(to_tips, dim=-1, keepdim=True),
            0.5 * mass.clamp(min=1e-3).log(),
            3 * friction,
            3 * self.here(linear),
            0.3 * self.here(angular),
            3 * self.here(self.state.tip_velocities[:, None]),
        ]


def _extent(
    offsets: Float[Tensor, "row push point"], is_low: Bool[Tensor, "row 1 point"]
) -> tuple[Float[Tensor, "row push 1"], Float[Tensor, "row push 1"]]:
    """The largest and the smallest offset of the points that carry the target."""
    largest = offsets.masked_fill(~is_low, -1.0).amax(-1, keepdim=True)
    return largest, offsets.masked_fill(~is_low, 1.0).amin(-1, keepdim=True)


def _tilt_and_twist(turn: Float[Tensor, "row 4"]) -> tuple[Float[Tensor, "row 3"], Float[Tensor, "row"]]:
    """Horizontal rotation vectors and angles, as :func:`dapl_baselines.planners.motions.tilt_and_twist` has them."""
    turn = torch.where(turn[:, :1] < 0, -turn, turn)
    upright, twist = torch.hypot(turn[:, 0], turn[:, 3]), 2 * torch.atan2(turn[:, 3], turn[:, 0])
    c, s, zero = torch.cos(twist / 2), torch.sin(twist / 2), torch.zeros_like(twist)
    axis = torch.stack([c * turn[:, 1] + s * turn[:, 2], c * turn[:, 2] - s * turn[:, 1], zero], dim=-1)
    sine = torch.linalg.vector_norm(axis, dim=-1)
    angle = 2 * torch.atan2(sine, upright) / sine.clamp(min=_EPSILON)
    return angle[:, None] * axis, torch.atan2(twist.sin(), twist.cos())
