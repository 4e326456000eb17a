"""Carrying pushes out, slot by slot: fly to the start, over what stands in the way, then follow the path.

A push that stalls, or takes too long, is given up; whoever chose it chooses anew.
"""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from jaxtyping import Bool, Float64, Int

from clutter6d.envs.action import ActionConfig
from clutter6d.geometry import quat_to_matrix
from clutter6d.sim.end_effector import HAND_BOX
from clutter6d.sim.kinematics import HandKinematics
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.robot_facts import TIP_OFFSET_M
from dapl_baselines.planners.hand_servo import MAX_TURN_RAD, joint_steps, tip_positions
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.arm_response import residuals_for

Slots = Int[np.ndarray, "slot"]

POINTING_DOWN: Final = np.diag([1.0, -1.0, -1.0])
"""Rotation of a hand that points straight down, hand frame to world frame."""
LOWEST_TIP_M: Final = 0.012
"""Lower the tips go to lower contacts alone, half way down from these: to touch thin things, or to press on them."""
ARRIVED_M: Final = 0.009
FLIGHT_SPEED_M: Final = 0.045
"""Movement asked for in a control step while flying; the arm makes 2 to 3.5 cm of it."""
SLOW_DOWN_M: Final = 0.04
"""Nearer to the start than this, no step is asked for that is longer than the way."""
CORRIDOR_M: Final = 0.045
"""What stands nearer than this to the line of flight must be flown over: half a hand's thickness and some room."""
CLEARANCE_M: Final = 0.025
BEHIND_M: Final = 0.035
ABOVE_START_M: Final = 0.02
"""The hand comes down when it is horizontally nearer to the start than this."""
LAG_M: Final = 0.02
"""The tips may lag so far behind the path, and a step more, before the path waits for them."""
STALLED_STEPS: Final = 4
"""Control steps of waiting, or of flying without coming on, after which a push is given up."""
STILL_M: Final = 0.003
"""Tips that move by less in a control step of a flight do not come on: something is in the way."""
NEARLY_THERE_M: Final = 0.03
"""Tips that do not come on, but are nearer to the start than this, begin the push from there."""
FLIGHT_TURN_RAD: Final = 0.06
"""While flying far from the start, the hand is turned by no more in a control step about any axis.

Residuals are bounded, and shortened together so that the tips keep their direction: with as much as while pushing, the
wrist takes so much of them that the tips fly at 2.0 cm a step. They fly at 2.4 cm with this all the way.
"""
TURN_M: Final = 0.10
"""Nearer to the start, the hand is turned as while pushing: turned the wrong way it would come down on the target."""
HOME_SHARE: Final = 0.2
MAX_HOME_RAD: Final = 0.04
"""In each control step the elbow, which may be anywhere while the hand is where it should be, goes home by this share.

Otherwise it wanders with every push, in the end to where joints are at their limits, and what a push does depends on
where the elbow has come to.
"""
ROOM_M: Final = 0.01
"""What is nearer to the palm than this where a push would start keeps the hand from getting there."""
REFUSED: Final = 4
REFUSED_M: Final = 0.025
"""So many starts that flights did not reach are remembered, and none nearer to them than this is tried again, until the
target has moved by as much."""
MAX_STEPS: Final = 60
MAX_SEGMENT_STEPS: Final = 12


@dataclass(kw_only=True, slots=True, eq=False)
class PushTracker:
    """What is being carried out in each slot.

    Attributes:
        size: Slots.
        starts: Where the path begins, world frame [m].
        contacts: Where it turns into the push's direction.
        directions: Unit vectors.
        lengths: Of the paths' last parts [m].
        speeds: Movement of the tips in a control step [m].
        floors: How low the tips may go [m].
        hands: How the hand is held, hand frame to world frame.
        is_pushing: Whether the flight is over.
        done: How far along its path each slot is meant to be [m].
        stalled: Control steps for which the path has waited, or the flight has not come on.
        last_tips: Where the tips were at the last control step [m].
        ages: Control steps since the push was given.
        limits: Control steps that it may take.
        origins: Where the targets were when it was given, world frame [m].
        refused: Starts that flights did not reach, world frame [m]; infinite where there are none.
        refused_at: Where the targets were then [m].
    """

    size: int
    starts: Float64[np.ndarray, "slot 3"] = field(init=False)
    contacts: Float64[np.ndarray, "slot 3"] = field(init=False)
    directions: Float64[np.ndarray, "slot 3"] = field(init=False)
    lengths: Float64[np.ndarray, "slot"] = field(init=False)
    speeds: Float64[np.ndarray, "slot"] = field(init=False)
    floors: Float64[np.ndarray, "slot"] = field(init=False)
    hands: Float64[np.ndarray, "slot 3 3"] = field(init=False)
    is_pushing: Bool[np.ndarray, "slot"] = field(init=False)
    done: Float64[np.ndarray, "slot"] = field(init=False)
    stalled: Int[np.ndarray, "slot"] = field(init=False)
    last_tips: Float64[np.ndarray, "slot 3"] = field(init=False)
    ages: Int[np.ndarray, "slot"] = field(init=False)
    limits: Int[np.ndarray, "slot"] = field(init=False)
    origins: Float64[np.ndarray, "slot 3"] = field(init=False)
    refused: Float64[np.ndarray, "slot refused 3"] = field(init=False)
    refused_at: Float64[np.ndarray, "slot 3"] = field(init=False)

    def __post_init__(self) -> None:
        """Slots without a push: what they have is over."""
        size = self.size
        self.starts, self.contacts, self.directions, self.last_tips = np.zeros((4, size, 3))
        self.origins, self.refused_at, self.refused = *np.zeros((2, size, 3)), np.full((size, REFUSED, 3), np.inf)
        self.lengths, self.speeds, self.floors, self.done = np.zeros((4, size))
        self.hands = np.tile(POINTING_DOWN, (size, 1, 1))
        self.is_pushing = np.ones(size, dtype=bool)
        self.stalled, self.ages, self.limits = np.zeros((3, size), dtype=np.int64)

    def begin(
        self, slots: Slots, pushes: Float64[np.ndarray, "slot push"], origins: Float64[np.ndarray, "slot 3"]
    ) -> None:
        """Give slots pushes.

        Args:
            slots: Which.
            pushes: Rows of :mod:`dapl_baselines.push_policy.push`.
            origins: The targets' positions, which the pushes' points are offsets from.
        """
        is_segment = pushes[:, columns.IS_SEGMENT] > 0.5
        starts, contacts = origins + pushes[:, columns.START], origins + pushes[:, columns.CONTACT]
        self.starts[slots], self.origins[slots] = starts, origins
        self.floors[slots] = np.where(contacts[:, 2] < LOWEST_TIP_M, contacts[:, 2] / 2, LOWEST_TIP_M)
        self.contacts[slots] = np.where(is_segment[:, None], starts, contacts)
        self.directions[slots] = pushes[:, columns.DIRECTION]
        self.lengths[slots], self.speeds[slots] = pushes[:, columns.LENGTH], pushes[:, columns.SPEED]
        self.hands[slots] = quat_to_matrix(pushes[:, columns.HAND]) @ POINTING_DOWN
        self.is_pushing[slots] = is_segment
        self.done[slots], self.stalled[slots], self.ages[slots], self.last_tips[slots] = 0.0, 0, 0, np.inf
        self.limits[slots] = np.where(is_segment, MAX_SEGMENT_STEPS, MAX_STEPS)

    def forget(self, slots: Slots) -> None:
        """Episodes begin in slots: nothing is carried out, and nothing was refused."""
        self.is_pushing[slots], self.refused[slots] = True, np.inf

    def may_begin(
        self,
        slots: Slots,
        pushes: Float64[np.ndarray, "slot push"],
        origins: Float64[np.ndarray, "slot 3"],
        around: Float64[np.ndarray, "slot point 3"],
    ) -> Bool[np.ndarray, "slot"]:
        """Which pushes have a start that the hand has room at, and that no flight has failed to reach.

        Args:
            slots: Whose.
            pushes: As for :meth:`begin`.
            origins: As for :meth:`begin`.
            around: Points of what stands around, world frame [m].
        """
        starts = origins + pushes[:, columns.START]
        has_moved = _lengths(origins - self.refused_at[slots]) > REFUSED_M
        is_refused = (_lengths(self.refused[slots] - starts[:, None]) < REFUSED_M).any(axis=1) & ~has_moved
        hands = quat_to_matrix(pushes[:, columns.HAND]) @ POINTING_DOWN
        offsets = around - (starts - TIP_OFFSET_M * hands[:, :, 2])[:, None]
        in_palm = np.abs(offsets @ hands - HAND_BOX.centre_m) < np.array(HAND_BOX.half_m) + ROOM_M
        has_room = ~in_palm.all(axis=-1).any(axis=-1)
        return (pushes[:, columns.IS_SEGMENT] > 0.5) | (has_room & ~is_refused)

    def is_over(self) -> Bool[np.ndarray, "slot"]:
        """Whether the push of each slot is carried out or given up."""
        has_arrived = self.is_pushing & (self.done >= self._path_lengths() - 1e-6)
        return has_arrived | (self.stalled >= STALLED_STEPS) | (self.ages >= self.limits)

    def residuals(
        self,
        hand: HandKinematics[np.ndarray],
        qpos: Float64[np.ndarray, "slot 7"],
        qvel: Float64[np.ndarray, "slot 7"],
        obstacles: Float64[np.ndarray, "slot point 3"],
        config: ActionConfig,
    ) -> Float64[np.ndarray, "slot 7"]:
        """Joint residuals of the next control step [rad], one row for each slot.

        Args:
            hand: Kinematics of the hands.
            qpos: Joint angles [rad].
            qvel: Joint velocities [rad/s].
            obstacles: Points that are flown over, world frame [m].
            config: The action's bounds.
        """
        tips = tip_positions(hand.pose)
        distances = _lengths(self.starts - tips)
        self.ages += 1
        self._arrive(tips, distances)
        flight_speeds = np.where(distances < SLOW_DOWN_M, np.maximum(distances, 0.01), FLIGHT_SPEED_M)
        targets = np.where(self.is_pushing[:, None], self._push_on(tips), self._fly(tips, obstacles))
        speeds = np.where(self.is_pushing, np.maximum(self.speeds, 0.015) + 0.01, flight_speeds)
        home = np.clip(HOME_SHARE * (HOME_QPOS - qpos), -MAX_HOME_RAD, MAX_HOME_RAD)
        turns = np.where(self.is_pushing | (distances < TURN_M), MAX_TURN_RAD, FLIGHT_TURN_RAD)
        steps = joint_steps(hand, targets, self.hands, speeds, home, max_turn_rad=turns)
        return residuals_for(steps, qvel, config)

    def _arrive(self, tips: Float64[np.ndarray, "slot 3"], distances: Float64[np.ndarray, "slot"]) -> None:
        """End the flights that are there, or as near as they come."""
        is_still = _lengths(tips - self.last_tips) < STILL_M
        has_arrived = ~self.is_pushing & ((distances < ARRIVED_M) | (is_still & (distances < NEARLY_THERE_M)))
        self.stalled = np.where(~self.is_pushing & is_still, self.stalled + 1, self.stalled)
        self.stalled[has_arrived | (~self.is_pushing & ~is_still)] = 0
        self.is_pushing |= has_arrived
        self.last_tips = tips.copy()
        self._refuse(np.flatnonzero(~self.is_pushing & self.is_over()))

    def _refuse(self, slots: Slots) -> None:
        """Remember starts that were not reached; what was refused with the target elsewhere is forgotten."""
        has_moved = _lengths(self.origins[slots] - self.refused_at[slots]) > REFUSED_M
        self.refused[slots[has_moved]] = np.inf
        self.refused[slots] = np.roll(self.refused[slots], 1, axis=1)
        self.refused[slots, 0], self.refused_at[slots] = self.starts[slots], self.origins[slots]

    def _path_lengths(self) -> Float64[np.ndarray, "slot"]:
        return _lengths(self.contacts - self.starts) + self.lengths

    def _at(self, done: Float64[np.ndarray, "slot"]) -> Float64[np.ndarray, "slot 3"]:
        """The points of the paths so far from their starts."""
        approach = self.contacts - self.starts
        length = _lengths(approach)
        share = np.minimum(done, length) / np.maximum(length, 1e-6)
        beyond = np.clip(done - length, 0.0, None)
        return self.starts + share[:, None] * approach + beyond[:, None] * self.directions

    def _push_on(self, tips: Float64[np.ndarray, "slot 3"]) -> Float64[np.ndarray, "slot 3"]:
        """The next points of the paths; a path goes on when its tips have kept up."""
        ahead = np.minimum(self.done + self.speeds, self._path_lengths())
        targets = self._at(ahead)
        targets[:, 2] = np.maximum(targets[:, 2], self.floors)
        keeps_up = _lengths(self._at(self.done) - tips) < LAG_M + self.speeds
        self.done = np.where(self.is_pushing & keeps_up, ahead, self.done)
        self.stalled = np.where(self.is_pushing, np.where(keeps_up, 0, self.stalled + 1), self.stalled)
        return targets

    def _fly(
        self, tips: Float64[np.ndarray, "slot 3"], obstacles: Float64[np.ndarray, "slot point 3"]
    ) -> Float64[np.ndarray, "slot 3"]:
        """Towards the starts, above what stands in the corridor, and first up where that is near."""
        way = self.starts[:, :2] - tips[:, :2]
        length = _lengths(way)
        forward = way / np.maximum(length, 1e-6)[:, None]
        offsets = obstacles[..., :2] - tips[:, None, :2]
        along = (offsets * forward[:, None]).sum(axis=-1)
        aside = np.abs(offsets[..., 0] * forward[:, None, 1] - offsets[..., 1] * forward[:, None, 0])
        is_inside = (aside < CORRIDOR_M) & (along > -BEHIND_M) & (along < length[:, None] - 0.005)
        is_inside &= length[:, None] > ABOVE_START_M
        height = np.where(is_inside, obstacles[..., 2], -1.0).max(axis=1) + CLEARANCE_M
        must_rise, targets = height > self.starts[:, 2], self.starts.copy()
        targets[:, 2] = np.maximum(targets[:, 2], height)
        is_higher = is_inside & (obstacles[..., 2] > tips[:, None, 2] - 0.01)
        is_near = np.where(is_higher, along, np.inf).min(axis=1) < 0.07
        is_blocked = must_rise & (tips[:, 2] < height - 0.012) & is_near
        targets[is_blocked, :2] = tips[is_blocked, :2]
        return targets


def _lengths(vectors: Float64[np.ndarray, "*n _"]) -> Float64[np.ndarray, "*n"]:
    return np.sqrt((vectors**2).sum(axis=-1))
