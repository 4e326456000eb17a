import numpy as np
import pytest

from dapl_baselines.teleop.keyboard import HOLD_S, MOVES, KeyboardDevice


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def keyboard(clock) -> KeyboardDevice:
    return KeyboardDevice(clock)


@pytest.mark.parametrize("key", MOVES)
def test_each_key_moves_along_or_about_one_axis(keyboard, key):
    axis, sign = MOVES[key]
    expected = np.zeros(6)
    expected[axis] = 0.5 * sign
    np.testing.assert_array_equal(keyboard.read((key,)).deflection, expected)


def test_every_axis_has_a_key_for_each_direction():
    assert sorted(MOVES.values()) == [(axis, sign) for axis in range(6) for sign in (-1, 1)]


def test_a_key_that_is_let_go_stops_the_arm(keyboard, clock):
    assert keyboard.read(("i",)).deflection.any()
    clock.now += HOLD_S + 0.01
    assert not keyboard.read(()).deflection.any()


def test_a_key_that_repeats_counts_as_held(keyboard, clock):
    for _ in range(20):
        assert keyboard.read(("i",)).deflection[0] == 0.5
        clock.now += 0.04


def test_keys_add_up_and_opposite_ones_cancel(keyboard):
    np.testing.assert_array_equal(keyboard.read(("i", "j", "o", "u")).deflection, [0.5, 0.5, 0, 0, 0, 0])


def test_digits_choose_the_speed(keyboard):
    assert keyboard.read(("3", "i")).deflection[0] == 1.0
    assert keyboard.read(("1", "i")).deflection[0] == 0.15
    assert keyboard.read(("i",)).deflection[0] == 0.15


def test_connecting_anew_forgets_what_was_held(keyboard):
    keyboard.read(("i",))
    keyboard.connect()
    assert not keyboard.read(()).deflection.any()
