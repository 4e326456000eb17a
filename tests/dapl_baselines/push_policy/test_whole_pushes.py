import numpy as np
import pytest

from clutter6d.geometry import is_unit, quat_from_axis_angle, quat_from_yaw, quat_to_matrix
from clutter6d.seeding import generator
from dapl_baselines.planners import motions
from dapl_baselines.planners.config import PushConfig
from dapl_baselines.planners.motions import tilt_and_twist
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy import whole_pushes
from dapl_baselines.push_policy.reach import REACH_M, wrist_distances
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.push_policy.whole_pushes import (
    ALL,
    AXIS_NOISE_RAD,
    DIRECTION_NOISE,
    FRICTION_CONE_RAD,
    LENGTH_M,
    LOWEST_CONTACT_M,
    LOWEST_START_M,
    MAX_TILT_RAD,
    MOVE,
    MOVE_SHARES,
    SPEED_M,
    TEMPERATURE,
    TIP,
    TIP_SHARES,
    TURN,
    _intent,
    _tilt_and_twist,
    draw_whole_pushes,
)
from tests.dapl_baselines.push_policy.drawn import SHAPES, draw_goals, draw_quats, draw_state
from tests.scene_fixtures import make_box_asset

STANDING = np.array([0.05, -0.1, 0.07, 1.0, 0.0, 0.0, 0.0])


def draw(poses: np.ndarray, goals: np.ndarray, count: int = 300, seed: int = 0) -> np.ndarray:
    poses, goals = np.atleast_2d(poses), np.atleast_2d(goals)
    rotation = quat_to_matrix(poses[:, 3:]).transpose(0, 2, 1)
    points, normals = SHAPES.contacts[[0]] @ rotation, SHAPES.normals[[0]] @ rotation
    return draw_whole_pushes(poses, goals, points, normals, count, generator(seed, "test"))


def test_tilt_and_twist_are_the_planners():
    starts, goals = draw_quats(200, generator(0, "starts")), draw_quats(200, generator(0, "goals"))
    goals[:20] = starts[:20]
    for start, goal in zip(starts, goals, strict=True):
        *found, twist = _tilt_and_twist(start, goal)
        tilt, expected = tilt_and_twist(start, goal)
        np.testing.assert_allclose([*found, 0.0], tilt, atol=1e-7)
        assert np.abs(np.angle(np.exp(1j * (twist - expected)))) < 1e-7


@pytest.mark.parametrize(("tilt", "shares"), [(0.0, MOVE_SHARES), (1.0, TIP_SHARES)])
def test_intents_are_as_frequent_as_their_shares(tilt, shares):
    drawn = [_intent(uniform, tilt, 1.0) for uniform in generator(0, "intents").random(4000)]
    frequencies = [drawn.count(intent) / 4000 for intent in (MOVE, TIP, TURN, ALL)]
    np.testing.assert_allclose(frequencies, np.diff([0.0, *shares, 1.0]), atol=0.03)


def test_an_object_that_only_must_be_moved_is_not_tipped_or_turned():
    assert {_intent(uniform, 0.1, 0.05) for uniform in np.linspace(0, 1, 20)} == {MOVE}


def test_what_the_compiled_code_must_repeat_is_as_the_planner_has_it():
    config = PushConfig()
    np.testing.assert_allclose(np.diff([0.0, *MOVE_SHARES, 1.0]), config.upright_shares)
    np.testing.assert_allclose(np.diff([0.0, *TIP_SHARES, 1.0]), config.tipping_shares)
    assert (config.axis_noise_rad, config.friction_cone_rad) == (AXIS_NOISE_RAD, FRICTION_CONE_RAD)
    assert (config.score_temperature, config.direction_noise) == (TEMPERATURE, DIRECTION_NOISE)
    for name in ("UPRIGHT_RAD", "ALIGNED_RAD", "OVERHEAD_RAD", "FAR_TURN_RAD", "LOW_M"):
        assert getattr(whole_pushes, name) == getattr(motions, f"_{name}"), name


def test_contacts_are_contact_points_with_their_normals():
    state, goals = draw_state(20), draw_goals(20)
    pushes, rotation = draw(state.poses, goals, 30), quat_to_matrix(state.poses[:, 3:])
    here, normals = pushes[..., columns.CONTACT] @ rotation, pushes[..., columns.NORMAL] @ rotation
    offsets = np.abs(here[:, :, None] - SHAPES.contacts[0]).sum(axis=-1)
    nearest = offsets.argmin(axis=-1)
    assert offsets.min(axis=-1).max() < 1e-12
    np.testing.assert_allclose(normals, SHAPES.normals[0][nearest], atol=1e-12)


def test_what_is_drawn_can_be_carried_out():
    state, goals = draw_state(20), draw_goals(20)
    poses = state.poses.copy()
    poses[:, 2] = 0.08
    pushes, height = draw(poses, goals, 30), poses[:, None, 2]
    assert np.isfinite(pushes).all()
    np.testing.assert_allclose(np.linalg.norm(pushes[..., columns.DIRECTION], axis=-1), 1.0)
    assert is_unit(pushes[..., columns.HAND]).all()
    assert (height + pushes[..., columns.START][..., 2] > LOWEST_START_M - 1e-12).all()
    for column, (least, most) in ((columns.LENGTH, LENGTH_M), (columns.SPEED, SPEED_M)):
        assert ((pushes[..., column] >= least) & (pushes[..., column] <= most)).all()
    assert (pushes[..., columns.IS_SEGMENT] == 0).all()


def test_no_contact_is_chosen_that_the_table_is_too_near_to():
    pushes = draw(STANDING, STANDING + np.array([0.1, 0.1, 0, 0, 0, 0, 0]))
    assert (STANDING[2] + pushes[..., columns.CONTACT][..., 2] > LOWEST_CONTACT_M).all()


def test_a_thin_plate_is_pushed_at_all_its_edges_and_not_under_half_its_height():
    shapes = TargetShapes.of([make_box_asset("plate", (0.12, 0.10, 0.008))])
    pose = np.array([[0.05, -0.1, 0.004, 1.0, 0.0, 0.0, 0.0]])
    goal = pose + np.array([0.1, 0.1, 0, 0, 0, 0, 0])
    pushes = draw_whole_pushes(pose, goal, shapes.contacts, shapes.normals, 300, generator(0, "plate"))[0]
    contacts, starts = (pose[0, :3] + pushes[:, part] for part in (columns.CONTACT, columns.START))
    assert (contacts[:, 2] > 0.004 - 1e-9).all()
    assert len(np.unique(contacts, axis=0)) > 5
    is_beside = np.abs(pushes[:, columns.NORMAL][:, 2]) < 0.1
    assert is_beside.mean() > 0.3
    assert (starts[is_beside, 2] <= 0.008).all()


def test_starts_are_within_reach_wherever_the_target_is():
    at_the_edge = np.array([0.30, 0.1, 0.07, 1.0, 0.0, 0.0, 0.0])
    (pushes,) = draw(at_the_edge, at_the_edge - np.array([0.2, 0.1, 0, 0, 0, 0, 0]))
    distances = wrist_distances(at_the_edge[:3] + pushes[:, columns.START], pushes[:, columns.HAND])
    assert distances.max() <= REACH_M
    beyond = at_the_edge + np.array([0.6, 0, 0, 0, 0, 0, 0])
    (pushes,) = draw(beyond, at_the_edge)
    assert len(np.unique(pushes[:, columns.LENGTH])) == len(pushes)


def test_possible_pushes_take_the_places_of_the_others_by_turns():
    pushes = np.arange(10.0).reshape(2, 5, 1)
    is_possible = np.array([[False, True, False, True, False], [False] * 5])
    assert whole_pushes._only(pushes, is_possible)[..., 0].tolist() == [[1, 3, 1, 3, 1], [5, 6, 7, 8, 9]]


@pytest.mark.parametrize("way", [(0.0, 0.2), (0.2, 0.0), (0.0, -0.2)])
def test_a_box_that_only_must_be_moved_is_pushed_from_behind(way):
    goal = STANDING + np.array([*way, 0, 0, 0, 0, 0])
    pushes, forward = draw(STANDING, goal)[0], np.array([*way, 0.0]) / 0.2
    assert (pushes[:, columns.NORMAL] @ forward < -0.9).mean() > 0.7
    assert (pushes[:, columns.DIRECTION] @ forward > 0.7).mean() > 0.9


def test_a_box_that_must_be_tipped_is_often_touched_high_up():
    fallen = np.array([0.05, -0.1, 0.045, *quat_from_axis_angle(np.array([1.0, 0.0, 0.0]), np.pi / 2)])
    high = (draw(STANDING, fallen)[0][:, columns.CONTACT][:, 2] > 0.02).mean()
    moved = (draw(STANDING, STANDING + np.array([0.0, 0.2, 0, 0, 0, 0, 0]))[0][:, columns.CONTACT][:, 2] > 0.02).mean()
    assert high > moved + 0.15


@pytest.mark.parametrize("turn", [0.8, -0.8])
def test_a_box_that_must_be_turned_is_pushed_with_that_torque(turn):
    goal = np.concatenate([STANDING[:3], quat_from_yaw(turn)])
    pushes = draw(STANDING, goal)[0]
    torque = np.cross(pushes[:, columns.CONTACT], pushes[:, columns.DIRECTION])[:, 2]
    assert (np.sign(turn) * torque).mean() > 0.01


def test_hands_lean_back_from_the_push_by_at_most_the_tilt():
    goal = STANDING + np.array([0.0, 0.2, 0, 0, 0, 0, 0])
    pushes = draw(STANDING, goal)[0]
    behind = pushes[pushes[:, columns.NORMAL][:, 1] < -0.9]
    upward = quat_to_matrix(behind[:, columns.HAND])[:, :, 2]
    assert (np.arccos(np.clip(upward[:, 2], -1, 1)) < MAX_TILT_RAD + 1e-6).all()
    assert (upward[:, 1] <= 1e-9).mean() > 0.95
    assert upward[:, 1].mean() < -0.3


def test_pushes_depend_on_the_random_numbers_alone():
    state, goals = draw_state(5), draw_goals(5)
    assert np.array_equal(draw(state.poses, goals, 7), draw(state.poses, goals, 7))
    assert not np.array_equal(draw(state.poses, goals, 7), draw(state.poses, goals, 7, seed=1))


def test_even_a_target_at_its_goal_and_one_under_the_table_get_pushes():
    assert np.isfinite(draw(STANDING, STANDING)).all()
    sunk = STANDING - np.array([0, 0, 1.0, 0, 0, 0, 0])
    assert np.isfinite(draw(sunk, STANDING)).all()
