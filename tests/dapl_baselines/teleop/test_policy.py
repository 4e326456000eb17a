import numpy as np
import pytest

from clutter6d.errors import InvalidValueError
from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.eval.policy import Policy
from clutter6d.eval.replay import Replay
from clutter6d.eval.tables import read_actions
from clutter6d.sim.robot import HOME_QPOS
from dapl_baselines.teleop.operator import OperatorLeftError
from dapl_baselines.teleop.policy import TeleopPolicy
from tests.dapl_baselines.teleop.people import Arm, Lever, Person, Window, no_wait
from tests.scene_fixtures import make_box_scene_set

STEPS = 12
CONFIG = EvaluationConfig(pairs=1, max_steps=STEPS)
WHOLE = ("enter", *[""] * (STEPS - 1))
"""A person who starts and then drives to the end."""


def policy(folder, *script, device=None, view=None, operator="", told=None) -> TeleopPolicy:
    return TeleopPolicy(
        device or Lever(),
        folder,
        keys=Person(*script),
        show=(lambda status: told.append(status)) if told is not None else lambda status: None,
        view=view,
        operator=operator,
        max_steps=STEPS,
        pace=no_wait(),
    )


def attempt(folder, *script, scenes=1, **options):
    """Run the person's attempts; returns the rows of those that ended."""
    person = policy(folder, *script, **options)
    rows = []
    try:
        for row in Evaluation(make_box_scene_set(scenes), person, folder, CONFIG).run(num_envs=1, threads=1):
            person.forget(*row.key)
            rows.append(row)
    except OperatorLeftError:
        pass
    return rows


def finish(folder, scenes=1):
    evaluation = Evaluation(make_box_scene_set(scenes), policy(folder), folder, CONFIG)
    list(evaluation.run("floor", threads=1))
    return evaluation.finish()


def test_a_person_is_a_policy_with_a_name_and_a_hash(tmp_path):
    person = policy(tmp_path, operator="left-hand")
    assert isinstance(person, Policy)
    assert person.name == "teleop-lever-left-hand"
    assert person.is_privileged
    assert person.policy_hash != policy(tmp_path).policy_hash
    stronger = Lever()
    stronger.settings = {"strength": 2}
    assert policy(tmp_path, device=stronger).policy_hash != policy(tmp_path).policy_hash


def test_attempts_are_recorded_and_replay_to_the_bit(tmp_path):
    rows = attempt(tmp_path, *WHOLE, *WHOLE, scenes=2)
    assert [(row.outcome, row.steps) for row in rows] == [("timeout", STEPS)] * 2
    report = finish(tmp_path, scenes=2)
    assert (report.policy, report.episodes) == ("teleop-lever", 2)
    assert all(np.abs(actions).max(axis=1).all() for actions in read_actions(tmp_path).values())
    check = Replay(tmp_path, make_box_scene_set(2))
    assert all(verdict.is_identical for verdict in check.run(num_envs=2, threads=1))
    assert check.check_report(num_envs=2, threads=1) == ()


def test_pausing_does_not_change_the_outcome(tmp_path):
    (smooth,) = attempt(tmp_path / "smooth", *WHOLE)
    halting = [entry for _ in range(STEPS) for entry in ("enter", "enter")]
    (paused,) = attempt(tmp_path / "paused", "", "", *halting, *WHOLE)
    assert paused.differences(smooth) == ()


def test_an_attempt_that_was_left_goes_on_where_it_was(tmp_path):
    def leading() -> Arm:
        return Arm(HOME_QPOS + 0.3)

    (whole,) = attempt(tmp_path / "whole", *WHOLE, device=leading())
    told = []
    assert attempt(tmp_path / "left", *WHOLE[:5], device=leading()) == []
    assert attempt(tmp_path / "left", "", "enter", "", device=leading(), told=told) == []
    (row,) = attempt(tmp_path / "left", *WHOLE, device=leading())
    assert row.differences(whole) == ()
    assert (told[0].step, told[0].phase, told[0].note) == (5, "ready", "goes on after step 5")
    assert sorted(path.name for path in (tmp_path / "left").iterdir()) == ["journal", "run.json"]


def test_giving_up_is_an_attempt_in_which_the_arm_stands_for_the_rest(tmp_path):
    told = []
    (row,) = attempt(tmp_path, "enter", "", "", "backspace", "backspace", told=told)
    assert (row.outcome, row.steps) == ("timeout", STEPS)
    finish(tmp_path)
    actions = read_actions(tmp_path)["boxes-0", 0]
    assert actions[:3].any(axis=1).all()
    assert not actions[3:].any()


def test_a_lost_device_loses_nothing(tmp_path):
    told = []
    assert attempt(tmp_path, "enter", "", "0", "", told=told) == []
    assert [status.phase for status in told] == ["driving", "driving", "paused", "paused"]
    assert told[-1].note == "the lever is gone"
    (row,) = attempt(tmp_path, *WHOLE)
    finish(tmp_path)
    actions = read_actions(tmp_path)[row.key]
    assert actions[1].any()
    assert not actions[2].any()
    assert actions[3].any()


def test_a_leader_arm_is_followed(tmp_path):
    device = Arm()
    device.joints = device.joints + 0.2
    attempt(tmp_path, *WHOLE, device=device)
    evaluation = Evaluation(make_box_scene_set(1), policy(tmp_path, device=device), tmp_path, CONFIG)
    (record,) = evaluation.finished().values()
    np.testing.assert_allclose(record.actions[0], 0.1, atol=1e-6)
    assert np.abs(record.actions[-1]).max() < 0.02


def test_the_window_shows_each_attempt_and_how_it_stands(tmp_path):
    view, told = Window(), []
    attempt(tmp_path, "", *WHOLE, *WHOLE, scenes=2, view=view, told=told)
    assert view.shown == [("boxes-0", 0), ("boxes-1", 0)]
    assert view.frames == 2 * STEPS
    assert f"steps left\t1 of {STEPS}" in view.text
    assert "lever\tpushes" in view.text
    assert [status.number for status in told][:: STEPS + 1] == [1, 2]
    assert told[0].position_error_m == pytest.approx(0.2, abs=1e-6)


def test_two_arms_at_once_are_refused(tmp_path):
    evaluation = Evaluation(make_box_scene_set(2), policy(tmp_path, *WHOLE), tmp_path, CONFIG)
    with pytest.raises(InvalidValueError, match="choose --num-envs 1"):
        list(evaluation.run(num_envs=2, threads=1))
