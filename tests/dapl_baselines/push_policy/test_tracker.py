"""Pushes carried out in simulation, at a box that stands on a table with others."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.slots import ClutterSlots
from clutter6d.geometry import quat_from_matrix, quat_to_matrix
from clutter6d.sim.contacts import find_contacts
from clutter6d.sim.kinematics import hand_kinematics, inverse_kinematics
from clutter6d.sim.model_variation import named_scales, vary_model
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.robot_facts import TIP_OFFSET_M
from clutter6d.sim.scene_model import SceneModel, joint_state
from dapl_baselines.planners.hand_servo import tip_positions
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.push_policy.tracker import MAX_SEGMENT_STEPS, MAX_STEPS, POINTING_DOWN, STALLED_STEPS, PushTracker
from tests.dapl_baselines.push_policy.drawn import make_push
from tests.scene_fixtures import make_box_scene

SCENE, MODEL = make_box_scene()
PAIR = SCENE.goal_pairs[0]
ORIGIN = np.array(PAIR.initial.position)
DOWN_ACROSS_X = (0.0, np.sqrt(0.5), np.sqrt(0.5), 0.0)
"""A hand that points down, its palm's long side along x."""


@dataclass(kw_only=True, eq=False)
class Film:
    """What happened step by step; arrays have axes ``step slot``."""

    tips: list[np.ndarray] = field(default_factory=list)
    targets: list[np.ndarray] = field(default_factory=list)
    is_pushing: list[np.ndarray] = field(default_factory=list)
    touches: list[bool] = field(default_factory=list)
    residuals: list[np.ndarray] = field(default_factory=list)
    over: list[np.ndarray] = field(default_factory=list)


class Stage:
    """Slots with a tracker, each with the box at its place and the hand beside it.

    Args:
        sides: Where each hand is, 10 cm from the box's middle: on the side of +y (1) or -y (-1); 0: at home.
        scene: The scene.
    """

    def __init__(self, *sides: float, scene: SceneModel = MODEL) -> None:
        self.slots, self.scene = np.arange(len(sides)), scene
        self.env = ClutterSlots([scene] * len(sides), threads=1)
        self.env.load(self.slots, [scene] * len(sides), [PAIR] * len(sides))
        self.shapes, self.tracker = TargetShapes.of(scene.assets[:1]), PushTracker(size=len(sides))
        for slot in np.flatnonzero(sides):
            hand = [*(ORIGIN + [0, 0.1 * sides[slot], TIP_OFFSET_M - 0.02]), *DOWN_ACROSS_X]
            joints, reached = inverse_kinematics(np.array([hand]), HOME_QPOS)
            assert reached.all()
            self.env.batch.reset(np.array([slot]), self.env.start_poses[[slot]], joints[0])

    def begin(self, *pushes: np.ndarray) -> None:
        self.tracker.begin(self.slots, np.stack(pushes), self.env.batch.object_poses[:, 0, :3].copy())

    def segment(self, direction: list[float]) -> np.ndarray:
        """A segment of the first slot from where the hand is, held as it is."""
        hand, push = hand_kinematics(self.env.batch.arm_qpos[:1]), make_push(1.0, is_segment=True)
        push[columns.START], push[columns.DIRECTION] = tip_positions(hand.pose)[0] - ORIGIN, direction
        push[columns.HAND] = quat_from_matrix(quat_to_matrix(hand.pose[0, 3:]) @ POINTING_DOWN)
        return push

    def tips(self) -> np.ndarray:
        return tip_positions(hand_kinematics(self.env.batch.arm_qpos).pose)

    def run(self, steps: int = MAX_STEPS + 1) -> Film:
        """Until all pushes are over, or for so many steps."""
        film, batch = Film(), self.env.batch
        for _ in range(steps):
            if self.tracker.is_over().all():
                break
            around = self.shapes.placed_contacts(0 * self.slots, batch.object_poses[:, 0])
            hand = hand_kinematics(batch.arm_qpos)
            residuals = self.tracker.residuals(hand, batch.arm_qpos, batch.arm_qvel, around, ActionConfig())
            self.env.step(self.slots, residuals.astype(np.float32))
            film.residuals.append(residuals)
            film.tips.append(self.tips())
            film.targets.append(batch.object_poses[:, 0].copy())
            film.is_pushing.append(self.tracker.is_pushing.copy())
            film.over.append(self.tracker.is_over())
            film.touches.append(self._touches())
        return film

    def _touches(self) -> bool:
        """Whether the robot touches the box of the first slot, or has moved it: a pushed box may slide a little on."""
        if np.linalg.norm(self.env.batch.object_poses[0, 0, :3] - ORIGIN) > 2e-3:
            return True
        qpos = np.concatenate([self.env.batch.arm_qpos[0], joint_state(self.env.batch.object_poses[:1])[0, 7:]])
        pairs = [contact.bodies for contact in find_contacts(self.scene, qpos) if "target" in contact.bodies]
        return any(not pair <= {*self.scene.names, "world"} for pair in pairs)


@pytest.fixture(scope="module", params=[1.0, -1.0], ids=["towards -y", "towards +y"])
def whole_push(request) -> tuple[float, Stage, Film]:
    """The hand is beside the box on one side, and pushes it from the other."""
    side = request.param
    stage = Stage(-side)
    stage.begin(make_push(side))
    return side, stage, stage.run()


def test_a_whole_push_flies_over_the_object_without_touching_it(whole_push):
    side, _, film = whole_push
    flight = np.flatnonzero(~np.array(film.is_pushing)[:, 0])
    tips = np.array(film.tips)[flight, 0]
    assert np.sign(tips[0, 1] - ORIGIN[1]) == -side
    assert np.sign(tips[-1, 1] - ORIGIN[1]) == side
    above = np.abs(tips[:, :2] - ORIGIN[:2]).max(axis=1) < 0.05
    assert above.any()
    assert (tips[above, 2] > 0.14).all()
    assert not any(film.touches[step] for step in flight)
    np.testing.assert_allclose(np.array(film.targets)[flight, 0, :3], np.tile(ORIGIN, (len(flight), 1)), atol=1e-3)


def test_it_touches_near_the_planned_contact(whole_push):
    side, _, film = whole_push
    first = film.touches.index(True)
    contact = ORIGIN + make_push(side)[columns.CONTACT]
    before, after = (film.tips[step][0] - contact for step in (first - 1, first))
    assert np.linalg.norm(before) < 0.02
    assert np.abs(after[[0, 2]]).max() < 0.01


def test_it_moves_the_box_along_its_direction_and_ends_where_it_was_meant_to(whole_push):
    side, stage, film = whole_push
    moved = film.targets[-1][0, :3] - ORIGIN
    assert -side * moved[1] == pytest.approx(0.06, abs=0.015)
    assert np.abs(moved[[0, 2]]).max() < 0.01
    end = ORIGIN + make_push(side)[columns.CONTACT] - [0, 0.06 * side, 0]
    np.testing.assert_allclose(stage.tips()[0], end, atol=0.02)
    assert len(film.tips) < MAX_STEPS


def test_the_hand_is_held_as_the_push_says(whole_push):
    side, stage, _ = whole_push
    held = quat_to_matrix(hand_kinematics(stage.env.batch.arm_qpos).pose[0, 3:])
    wanted = quat_to_matrix(make_push(side)[columns.HAND]) @ POINTING_DOWN
    assert np.trace(held.T @ wanted) > 1 + 2 * np.cos(0.2)


def test_a_push_that_stalls_is_given_up():
    immovable = vary_model(MODEL, mass_scale=named_scales(MODEL.names, {"target": 1e4}))
    stage = Stage(1.0, scene=immovable)
    stage.begin(make_push(1.0))
    film = stage.run()
    assert stage.tracker.stalled[0] >= STALLED_STEPS
    assert len(film.tips) < MAX_STEPS
    np.testing.assert_allclose(film.targets[-1][0, :3], ORIGIN, atol=5e-3)


def test_a_segment_goes_straight_from_where_the_hand_is_and_ends_within_its_limit():
    stage = Stage(1.0)
    start, push = stage.tips()[0], stage.segment([1.0, 0.0, 0.0])
    stage.begin(push)
    assert stage.tracker.is_pushing[0]
    film = stage.run()
    assert 0 < len(film.tips) <= MAX_SEGMENT_STEPS
    path = np.array(film.tips)[:, 0] - start
    assert path[-1, 0] == pytest.approx(0.06, abs=0.015)
    assert np.abs(path[:, 1:]).max() < 0.015


@pytest.mark.parametrize(("is_segment", "limit"), [(False, MAX_STEPS), (True, MAX_SEGMENT_STEPS)])
def test_what_takes_too_long_is_given_up(is_segment, limit):
    stage, push = Stage(0.0), make_push(1.0, is_segment=is_segment)
    push[columns.START] = [0.0, 0.0, 2.0]
    push[columns.SPEED], push[columns.LENGTH] = 1e-4, 10.0
    push[columns.DIRECTION] = [0.0, 0.0, 1.0]
    stage.begin(push)
    stage.tracker.done[0] = 0.0
    ended = [bool(over[0]) for over in stage.run().over]
    assert ended == [False] * (len(ended) - 1) + [True]
    assert len(ended) <= limit


def test_tips_stay_above_the_table_whatever_the_path_says():
    stage = Stage(1.0)
    stage.begin(stage.segment([0.0, 0.0, -1.0]))
    assert min(tips[0, 2] for tips in stage.run().tips) > 0.005


def test_what_happens_in_a_slot_is_the_same_to_the_bit_whatever_the_others_do():
    push, other = make_push(-1.0), make_push(1.0)
    alone, together = Stage(1.0), Stage(-1.0, 1.0, 0.0)
    alone.begin(push)
    together.begin(other, push, make_push(1.0, is_segment=True))
    steps = 20
    seen, among = alone.run(steps), together.run(steps)
    assert np.array_equal(np.array(seen.residuals)[:, 0], np.array(among.residuals)[:, 1])
    assert np.array_equal(np.array(seen.targets)[:, 0], np.array(among.targets)[:, 1])


def test_a_slot_that_is_given_a_push_leaves_the_others_as_they_were():
    stage = Stage(1.0, -1.0)
    stage.begin(make_push(-1.0), make_push(1.0))
    stage.run(3)
    ages = stage.tracker.ages.copy()
    stage.tracker.begin(np.array([1]), make_push(-1.0)[None], stage.env.batch.object_poses[1:, 0, :3].copy())
    assert stage.tracker.ages.tolist() == [ages[0], 0]


NOWHERE = np.full((1, 1, 3), 5.0)


def may_begin(
    tracker: PushTracker, push: np.ndarray, origin: np.ndarray = ORIGIN, around: np.ndarray = NOWHERE
) -> bool:
    return bool(tracker.may_begin(np.array([0]), push[None], origin[None], around)[0])


def test_a_push_needs_room_for_the_palm_where_it_starts():
    tracker, push = PushTracker(size=1), make_push(1.0)
    hand = quat_to_matrix(push[columns.HAND]) @ POINTING_DOWN
    palm = ORIGIN + push[columns.START] + hand @ [0.0, 0.09, 0.033 - TIP_OFFSET_M]
    assert may_begin(tracker, push)
    assert not may_begin(tracker, push, around=palm[None, None])
    assert may_begin(tracker, push, around=(palm + hand @ [0.06, 0.0, 0.0])[None, None])
    assert may_begin(tracker, make_push(1.0, is_segment=True), around=palm[None, None])


def test_a_start_that_a_flight_did_not_reach_is_not_tried_again_until_the_target_has_moved():
    stage, push = Stage(0.0), make_push(1.0)
    push[columns.START] = [0.0, 0.0, 2.0]
    stage.begin(push)
    assert may_begin(stage.tracker, push)
    stage.run()
    beside, elsewhere = push.copy(), push.copy()
    beside[columns.START] += [0.0, 0.02, 0.0]
    elsewhere[columns.START] += [0.0, 0.03, 0.0]
    assert [may_begin(stage.tracker, each) for each in (push, beside, elsewhere)] == [False, False, True]
    assert may_begin(stage.tracker, push, ORIGIN + [0.03, 0.0, 0.0])
    stage.tracker.forget(np.array([0]))
    assert may_begin(stage.tracker, push)


def test_starts_that_were_reached_are_not_refused(whole_push):
    side, stage, _ = whole_push
    assert np.isinf(stage.tracker.refused).all()
    assert may_begin(stage.tracker, make_push(side))


@pytest.mark.parametrize(("contact_m", "lowest_m"), [(0.004, 0.002), (0.011, 0.0055), (0.013, 0.012), (0.05, 0.012)])
def test_tips_go_down_half_way_to_low_contacts_and_no_lower_than_they_must_to_others(contact_m, lowest_m):
    tracker, push = PushTracker(size=1), make_push(1.0)
    push[columns.CONTACT][2] = contact_m - ORIGIN[2]
    tracker.begin(np.array([0]), push[None], ORIGIN[None])
    assert tracker.floors[0] == pytest.approx(lowest_m)
