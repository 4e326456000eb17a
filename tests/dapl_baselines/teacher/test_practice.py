from pathlib import Path

import numpy as np
import pytest

from clutter6d.seeding import generator
from clutter6d.sim.robot import HOME_QPOS, hand_pose
from dapl_baselines.planners.hand_servo import tip_positions
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.critic import PushCritic
from dapl_baselines.push_policy.push_state import STATE_FIELDS
from dapl_baselines.replay import Replay
from dapl_baselines.teacher.learner import TeacherLearner
from dapl_baselines.teacher.practice import Practice
from dapl_baselines.teacher.training_state import Course, copy_state, read_state
from dapl_baselines.teacher.transitions import NO_LATER, Transitions
from dapl_baselines.tensor_file import write_tensor_file
from dapl_baselines.training_report import Standing
from tests.dapl_baselines.teacher.small_teacher import SETTINGS, small_scenes, small_shapes

LONG = SETTINGS.model_copy(update={"slots": 6, "steps": 130, "max_steps": 60})
HOME_TIPS = tip_positions(hand_pose(HOME_QPOS[None]))[0]


def make_course(folder: Path, settings=LONG) -> Course:
    shapes = small_shapes()
    practice = Practice(small_scenes(), shapes, settings, threads=1)
    replay = Replay(folder, practice.blank_rows(), settings.kept)
    return Course(learner=TeacherLearner(settings, shapes), practice=practice, replay=replay)


def all_rows(replay: Replay) -> Transitions:
    return Transitions.of_rows(replay.take(np.arange(replay.count), replay.fields))


@pytest.fixture(scope="module")
def practised(tmp_path_factory) -> Course:
    course = make_course(tmp_path_factory.mktemp("replay"))
    made = course.practice.run(course.learner.critic, course.replay, generator(0, "practice"))
    assert made == course.replay.count
    return course


def test_in_an_episode_the_end_of_a_push_is_the_beginning_of_the_next(practised):
    rows = all_rows(practised.replay)
    numbers = np.flatnonzero(rows.later != NO_LATER)
    later = rows.later[numbers]
    assert len(numbers) > 10
    assert (later > numbers).all()
    assert len(set(later)) == len(later)
    for name in STATE_FIELDS:
        assert np.array_equal(getattr(rows.after, name)[numbers], getattr(rows.before, name)[later]), name
    assert np.array_equal(rows.goals[numbers], rows.goals[later])
    assert np.array_equal(rows.targets[numbers], rows.targets[later])


def test_what_follows_nothing_begins_an_episode(practised):
    rows = all_rows(practised.replay)
    first = np.setdiff1d(np.arange(practised.replay.count), rows.later)
    assert len(first) > LONG.slots
    np.testing.assert_allclose(rows.before.tips[first], np.tile(HOME_TIPS, (len(first), 1)), atol=1e-6)
    starts = {pair.initial.position for scene in small_scenes().scenes for pair in scene.goal_pairs}
    for pose in rows.before.poses[first]:
        assert min(np.abs(pose[:3] - start).max() for start in starts) < 1e-6


def test_the_pushes_of_an_episode_take_its_steps(practised):
    rows = all_rows(practised.replay)
    first = np.setdiff1d(np.arange(practised.replay.count), rows.later)
    totals = []
    for number in first:
        steps = []
        while number != NO_LATER:
            steps.append(rows.steps[number])
            number = rows.later[number]
        totals.append(sum(steps))
    assert max(totals) == LONG.max_steps
    assert (rows.steps > 0).all()


def test_most_pushes_end_where_they_lead(practised):
    """But for those that stall, take too long, or end with their episode."""
    rows = all_rows(practised.replay)
    goes_on = rows.later != NO_LATER
    contacts = rows.before.poses[:, :3] + rows.pushes[:, columns.CONTACT]
    is_segment = rows.pushes[:, columns.IS_SEGMENT, None] > 0.5
    way = rows.pushes[:, columns.LENGTH, None] * rows.pushes[:, columns.DIRECTION]
    ends = np.where(is_segment, rows.before.tips, contacts) + way
    errors = np.linalg.norm(rows.after.tips - ends, axis=1)[goes_on]
    assert (errors < 0.02).mean() > 0.6


def test_nothing_is_random_but_what_is_drawn(practised, tmp_path):
    again = make_course(tmp_path)
    again.practice.run(again.learner.critic, again.replay, generator(0, "practice"))
    rows, others = (course.replay.take(np.arange(course.replay.count), course.replay.fields)
                    for course in (practised, again))  # fmt: skip
    assert all(np.array_equal(rows[name], others[name]) for name in rows)


def test_slots_of_chance_do_not_ask_the_critic(tmp_path):
    """With all of them so, two critics of other minds lead to the same."""
    settings = LONG.model_copy(update={"random_slots": 1.0, "steps": 30})
    counts = []
    for seed in (0, 1):
        course = make_course(tmp_path / str(seed), settings)
        critic = TeacherLearner(settings.model_copy(update={"seed": seed}), small_shapes()).critic
        critic.output.weight.data.normal_()
        course.practice.run(critic, course.replay, generator(0, "practice"))
        counts.append(course.replay.take(np.arange(course.replay.count), ["pushes"])["pushes"])
        assert course.practice.slots.tally.take().episodes == 0
    assert len(counts[0]) > 0
    assert np.array_equal(*counts)


def put_into_file(course: Course, path: Path) -> None:
    write_tensor_file(path, copy_state(Standing(iteration=3), course))


def go_on(course: Course, critic: PushCritic) -> dict[str, np.ndarray]:
    """What a course makes of the next steps."""
    before = course.replay.count
    course.practice.run(critic, course.replay, generator(0, "going on"))
    rows = course.replay.take(np.arange(before, course.replay.count), course.replay.fields)
    return {name: tensor.numpy() for name, tensor in rows.items()}


def test_from_a_state_it_goes_on_as_the_one_that_went_on(tmp_path):
    """Paused between pushes and flights, with objects asleep and awake."""
    settings = LONG.model_copy(update={"steps": 43})
    course = make_course(tmp_path / "replay", settings)
    critic = course.learner.critic
    course.practice.run(critic, course.replay, generator(0, "practice"))
    put_into_file(course, tmp_path / "state.pt")
    other = make_course(tmp_path / "other", settings)
    other.replay.add(course.replay.take(np.arange(course.replay.count), course.replay.fields))
    assert read_state(tmp_path / "state.pt", other).iteration == 3
    assert other.replay.count == course.replay.count
    one, same = (go_on(each, critic) for each in (course, other))
    assert len(one["steps"]) > 3
    assert all(np.array_equal(one[name], same[name]) for name in one)
    slots = course.practice.slots, other.practice.slots
    assert slots[0].tally.take() == slots[1].tally.take()


def test_pausing_changes_only_who_sleeps(tmp_path):
    course = make_course(tmp_path, LONG.model_copy(update={"steps": 5}))
    course.practice.run(course.learner.critic, course.replay, generator(0, "practice"))
    before, places = course.practice.slots.see(), course.practice.slots.places
    motion = course.practice.slots.pause()
    after = course.practice.slots.see()
    assert all(np.array_equal(getattr(before.state, name), getattr(after.state, name)) for name in STATE_FIELDS)
    course.practice.slots.return_to(places, motion)
    again = course.practice.slots.see()
    assert all(np.array_equal(getattr(before.state, name), getattr(again.state, name)) for name in STATE_FIELDS)
    assert np.array_equal(before.goals, again.goals)
