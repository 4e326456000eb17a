import contextlib
import os
import pty
import termios

import pytest

from dapl_baselines.teleop.terminal import Terminal, key_names


@pytest.fixture
def both_ends():
    master, slave = pty.openpty()
    yield master, slave
    for end in (master, slave):
        with contextlib.suppress(OSError):
            os.close(end)


def test_keys_are_read_as_they_are_pressed_and_without_echo(both_ends):
    master, slave = both_ends
    with Terminal(slave) as terminal:
        os.write(master, b"iI3\r \x7f")
        assert terminal.keys() == ("i", "i", "3", "enter", "space", "backspace")
        assert terminal.keys() == ()
        assert not termios.tcgetattr(slave)[3] & (termios.ECHO | termios.ICANON)


def test_the_terminal_is_left_as_it_was_found(both_ends):
    _, slave = both_ends
    before = termios.tcgetattr(slave)
    with pytest.raises(KeyboardInterrupt), Terminal(slave):
        raise KeyboardInterrupt
    assert termios.tcgetattr(slave) == before
    assert os.get_blocking(slave)


def test_a_terminal_that_is_hung_up_is_closed(both_ends):
    master, slave = both_ends
    with Terminal(slave) as terminal:
        os.close(master)
        assert terminal.keys() == ()
        assert terminal.is_closed


def test_a_pipe_is_no_terminal_and_has_no_keys():
    reader, writer = os.pipe()
    os.write(writer, b"i")
    with Terminal(reader) as terminal:
        assert not terminal.is_terminal
        assert terminal.keys() == ()
    os.close(reader)
    os.close(writer)


@pytest.mark.parametrize(
    ("typed", "names"),
    [
        ("\x1b[Ai", ("i",)),
        ("\x1bOPj", ("j",)),
        ("\x1b[1;5Ck", ("k",)),
        ("\x1b[3~x", ("x",)),
        ("\x1b", ()),
        ("\x1b[", ()),
        ("!,\t\0", ()),
        ("", ()),
    ],
)
def test_arrow_and_function_keys_are_not_taken_for_letters(typed, names):
    assert key_names(typed) == names
