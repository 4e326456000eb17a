import numpy as np
import pytest

from clutter6d.envs.action import ActionConfig
from clutter6d.sim.robot import HOME_QPOS
from dapl_baselines.teleop.keyboard import MOVES, KeyboardDevice
from dapl_baselines.teleop.motion import MotionConfig
from dapl_baselines.teleop.operator import RECONNECT_EVERY, Operator, OperatorLeftError, offered_actions
from tests.dapl_baselines.teleop.people import Arm, Lever, Person, Window


def operator(person, device=None, view=None) -> Operator:
    return Operator(device or Lever(), person, view, ActionConfig(), MotionConfig())


def drive(who: Operator, steps: int) -> list[str]:
    """What the arm did at each step: ``waits``, ``stands`` or ``moves``."""
    done = []
    for _ in range(steps):
        residuals = who.listen(HOME_QPOS)
        done.append("waits" if residuals is None else "moves" if residuals.any() else "stands")
    return done


def test_time_stands_still_until_the_person_starts():
    who = operator(Person("", "", "enter", "", ""))
    assert drive(who, 5) == ["waits", "waits", "moves", "moves", "moves"]


@pytest.mark.parametrize("key", ["enter", "space"])
def test_the_same_key_pauses_and_goes_on(key):
    who = operator(Person("enter", "", key, "", key, ""))
    assert drive(who, 6) == ["moves", "moves", "waits", "waits", "moves", "moves"]


def test_giving_up_is_asked_twice():
    who = operator(Person("enter", "backspace", "", "backspace", ""))
    assert drive(who, 3) == ["moves", "waits", "waits"]
    assert "once more" in who.note
    assert not who.has_given_up
    drive(who, 1)
    assert who.has_given_up


def test_going_on_after_the_question_does_not_give_up():
    who = operator(Person("enter", "backspace", "enter", "backspace", ""))
    assert drive(who, 5) == ["moves", "waits", "moves", "waits", "waits"]
    assert not who.has_given_up


def test_the_next_attempt_begins_without_what_was_asked_in_the_last():
    who = operator(Person("backspace", "backspace", "", "backspace", ""))
    drive(who, 2)
    assert who.has_given_up
    who.await_start()
    drive(who, 3)
    assert not who.has_given_up


@pytest.mark.parametrize("script", [("enter", "x"), ("x",), ("enter",)], ids=["driving", "ready", "terminal closed"])
def test_the_person_can_leave_at_any_time(script):
    with pytest.raises(OperatorLeftError):
        drive(operator(Person(*script)), 3)


def test_a_closed_window_is_leaving():
    view = Window()
    view.close()
    with pytest.raises(OperatorLeftError):
        drive(operator(Person("", ""), view=view), 1)


def test_a_device_that_is_lost_stops_the_arm_and_pauses_with_a_line():
    who = operator(Person("enter", "", "0", "", "enter", ""))
    assert drive(who, 6) == ["moves", "moves", "stands", "waits", "waits", "waits"]
    assert who.phase == "paused"
    assert who.note == "the lever is gone"


def test_a_device_that_is_back_waits_for_the_person():
    device = Lever()
    who = operator(Person("enter", "0", *[""] * 3 * RECONNECT_EVERY, "enter", ""), device)
    drive(who, 5)
    device.is_lost = False
    assert set(drive(who, 2 * RECONNECT_EVERY)) == {"waits"}
    assert who.note == "the lever is back"
    device_connections = device.connections
    drive(who, RECONNECT_EVERY - 3)
    assert drive(who, 2) == ["moves", "moves"]
    assert device.connections == device_connections == 1


def test_a_value_that_is_no_number_is_a_lost_device():
    device = Lever(np.full(6, np.nan))
    who = operator(Person("enter", "", ""), device)
    assert drive(who, 2) == ["waits", "waits"]
    assert "not a number" in who.note


def test_a_value_that_becomes_no_number_stops_the_arm():
    device = Lever()
    who = operator(Person("enter", "", ""), device)
    drive(who, 1)
    device.deflection = np.array([np.inf, 0, 0, 0, 0, 0])
    assert drive(who, 2) == ["stands", "waits"]


def test_a_leader_arm_must_stand_as_the_robot_does_before_it_leads():
    device = Arm(HOME_QPOS + np.array([0, 0, 0, 0.5, 0, 0, 0]))
    who = operator(Person("enter", "", "enter", ""), device)
    assert drive(who, 2) == ["waits", "waits"]
    assert who.note == "turn joint 4 by -29 degrees, to stand as the robot does"
    device.joints = HOME_QPOS + 0.05
    assert drive(who, 2) == ["moves", "moves"]


def test_keys_of_the_window_count_as_those_of_the_terminal():
    view = Window()
    who = operator(Person("", "", ""), KeyboardDevice(), view)
    view.asked = ["enter", "i"]
    assert drive(who, 1) == ["moves"]
    view.asked = ["backspace"]
    assert drive(who, 1) == ["waits"]


def test_the_window_offers_what_the_terminal_has():
    assert [action.name for action in offered_actions(Lever())] == ["enter", "backspace", "x"]
    names = {action.name for action in offered_actions(KeyboardDevice())}
    assert {"enter", "backspace", "x", *MOVES} <= names
