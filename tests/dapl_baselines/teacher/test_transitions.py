from dataclasses import fields, replace

import numpy as np
import pytest

from clutter6d.envs.termination import TerminationConfig, goal_errors, is_at_goal
from clutter6d.geometry import quat_conjugate, quat_multiply, quat_to_matrix
from clutter6d.seeding import generator
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.outcomes import Prices
from dapl_baselines.push_policy.push_state import STATE_FIELDS
from dapl_baselines.teacher.learner import gains_of, motions
from dapl_baselines.teacher.settings import GoalSettings
from dapl_baselines.teacher.transitions import (
    GOAL_AREA_M,
    NO_LATER,
    Transitions,
    mirrored,
    mirrored_pushes,
    take_transitions,
)
from tests.dapl_baselines.teacher.stories import draw_transitions, fill

OWN_GOALS = GoalSettings(later_share=0, moved_share=0)
LATER_GOALS = GoalSettings(later_share=1, moved_share=0, later_hop=0.3)
MOVED_GOALS = GoalSettings(later_share=0, moved_share=1, move_m=0.3)


def arrays(found: Transitions) -> dict[str, np.ndarray]:
    """All numbers of transitions by name."""
    flat = {field.name: getattr(found, field.name) for field in fields(found)}
    before, after = flat.pop("before"), flat.pop("after")
    named = [(f"{when}.{name}", getattr(state, name)) for when, state in (("before", before), ("after", after))
             for name in STATE_FIELDS]  # fmt: skip
    return flat | dict(named)


def take(replay, numbers, end: int, settings: GoalSettings, seed: int = 0) -> Transitions:
    return take_transitions(replay, np.array(numbers), end, settings, generator(seed, "taken"))


def is_there(poses: np.ndarray, goals: np.ndarray) -> np.ndarray:
    errors = goal_errors(poses.astype(np.float64), goals.astype(np.float64))
    return is_at_goal(errors.position_m, errors.rotation_rad, TerminationConfig())


@pytest.fixture(scope="module")
def story(tmp_path_factory):
    """Forty transitions of four slots: ``n`` is followed by ``n + 4``, but for 20 to 23, which end their episodes."""
    transitions = draw_transitions(40)
    later = np.arange(40) + 4
    later[[*range(20, 24), *range(36, 40)]] = NO_LATER
    transitions = replace(transitions, later=later)
    return transitions, fill(tmp_path_factory.mktemp("replay"), transitions)


def test_rows_come_back_from_the_replay_as_they_were(story):
    transitions, replay = story
    expected, found = arrays(transitions), arrays(take(replay, range(40), 40, OWN_GOALS))
    for name, array in expected.items():
        assert found[name].shape == array.shape
        np.testing.assert_allclose(found[name], array, rtol=1e-6, atol=1e-6, err_msg=name)


def test_hindsight_goals_are_later_poses_of_the_same_episode(story):
    """Compared with a loop along the links, for every start."""
    transitions, replay = story
    numbers = np.repeat(np.arange(40), 20)
    goals = take(replay, numbers, 40, LATER_GOALS).goals
    seen = set()
    for number, goal in zip(numbers, goals, strict=True):
        following, current = [], int(number)
        while current != NO_LATER:
            following.append(current)
            current = int(transitions.later[current])
        matches = [n for n in following if np.allclose(transitions.after.poses[n], goal, atol=1e-6)]
        assert len(matches) == 1
        seen.add(following.index(matches[0]))
    assert seen >= {0, 1, 2, 3}


def test_nothing_is_looked_at_from_the_end_on(story):
    transitions, replay = story
    goals = take(replay, np.repeat(np.arange(8), 50), 8, LATER_GOALS).goals
    known = transitions.after.poses[:8].astype(np.float32)
    assert all(np.abs(known - goal).max(axis=1).min() < 1e-6 for goal in goals)


def test_with_hops_of_one_the_goal_is_what_the_push_did(story):
    transitions, replay = story
    found = take(replay, range(40), 40, LATER_GOALS.model_copy(update={"later_hop": 1.0}))
    np.testing.assert_allclose(found.goals, transitions.after.poses, atol=1e-6)
    assert found.is_success.all()


def test_moved_goals_keep_their_resting_face_and_stay_on_the_table(story):
    transitions, replay = story
    found = take(replay, range(40), 40, MOVED_GOALS)
    turn = quat_multiply(found.goals[:, 3:].astype(np.float64), quat_conjugate(transitions.goals[:, 3:]))
    np.testing.assert_allclose(quat_to_matrix(turn)[:, 2], np.tile([0.0, 0, 1], (40, 1)), atol=1e-5)
    np.testing.assert_allclose(found.goals[:, 2], transitions.goals[:, 2], atol=1e-6)
    assert (np.abs(found.goals[:, :2]) <= np.array(GOAL_AREA_M) + 1e-6).all()
    away = np.linalg.norm((found.goals - transitions.before.poses)[:, :2], axis=1)
    inside = (np.abs(transitions.before.poses[:, :2]) < np.array(GOAL_AREA_M)).all(axis=1)
    assert (away[inside] <= 0.3 + 1e-6).all()


@pytest.mark.parametrize("settings", [LATER_GOALS, MOVED_GOALS])
def test_success_and_weights_are_those_of_the_new_goals(story, settings):
    _, replay = story
    found = take(replay, np.arange(200) % 40, 40, settings)
    assert np.array_equal(found.is_success, is_there(found.after.poses, found.goals))
    assert np.array_equal(found.weights > 0, ~is_there(found.before.poses, found.goals))


def test_a_push_from_a_goal_that_is_reached_counts_nothing(tmp_path):
    still = draw_transitions(8)
    replay = fill(tmp_path, replace(still, after=still.before))
    found = take(replay, range(8), 8, LATER_GOALS)
    assert (found.weights == 0).all()
    assert (take(replay, range(8), 8, OWN_GOALS).weights == 1).all()


def test_shares_of_other_goals_are_kept_to(story):
    transitions, replay = story
    settings = GoalSettings(later_share=0.25, moved_share=0.5)
    found = take(replay, range(40), 40, settings)
    own = np.isclose(found.goals, transitions.goals, atol=1e-6).all(axis=1)
    assert (~own).sum() == 30
    assert own[30:].all()
    assert np.array_equal(found.is_success[own], transitions.is_success[own])


def test_mirrored_twice_it_is_as_it_was():
    transitions = draw_transitions(10)
    twice = arrays(mirrored(mirrored(transitions)))
    for name, array in arrays(transitions).items():
        np.testing.assert_array_equal(twice[name], array, err_msg=name)


def test_the_mirror_turns_every_rotation_into_its_mirror_image():
    transitions, mirror = draw_transitions(10), np.diag([1.0, -1.0, 1.0])
    found = mirrored(transitions)
    for of in (lambda t: t.before.poses[:, 3:], lambda t: t.goals[:, 3:], lambda t: t.before.hands,
               lambda t: t.pushes[:, columns.HAND]):  # fmt: skip
        expected = mirror @ quat_to_matrix(of(transitions)) @ mirror
        np.testing.assert_allclose(quat_to_matrix(of(found)), expected, atol=1e-12)


def test_in_the_mirror_things_go_on_as_they_did_mirrored():
    """An angular velocity turns the mirrored target as it turned the target."""
    transitions, mirror = draw_transitions(10), np.diag([1.0, -1.0, 1.0])
    found, point = mirrored(transitions), np.array([0.1, 0.2, 0.3])

    def velocity(state, at):
        return state.velocities[:, :3] + np.cross(state.velocities[:, 3:], at)

    np.testing.assert_allclose(
        velocity(found.before, mirror @ point), velocity(transitions.before, point) @ mirror, atol=1e-12
    )


def test_what_pushes_bring_is_the_same_in_the_mirror_and_motions_are_mirrored():
    transitions = draw_transitions(30)
    found, prices = mirrored(transitions), Prices()
    np.testing.assert_allclose(gains_of(found, prices), gains_of(transitions, prices), atol=1e-6)
    expected = motions(transitions).numpy() * [1, -1, 1, -1, 1, -1]
    np.testing.assert_allclose(motions(found).numpy(), expected, atol=1e-4)


def test_a_mirrored_push_is_mirrored_in_all_its_parts():
    push = draw_transitions(3).pushes
    found = mirrored_pushes(push)
    for part in columns.VECTORS:
        np.testing.assert_array_equal(found[:, part], push[:, part] * [1, -1, 1])
    for column in (columns.LENGTH, columns.SPEED, columns.IS_SEGMENT):
        np.testing.assert_array_equal(found[:, column], push[:, column])
