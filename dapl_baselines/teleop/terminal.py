"""Single key presses from a terminal, also over ssh."""

import contextlib
import os
import select
import sys
import termios
import tty
from types import TracebackType
from typing import Any

_NAMES = {"\r": "enter", "\n": "enter", " ": "space", "\x7f": "backspace", "\b": "backspace"}
_ESCAPE = "\x1b"


class Terminal:
    """The terminal's keys, one at a time and without echo, until it is closed; Ctrl-C works as ever.

    Args:
        file: Standard input, or another file descriptor.

    Attributes:
        is_terminal: Whether there is a terminal; if not, no key is ever pressed.
        is_closed: Whether it was hung up.
    """

    def __init__(self, file: int | None = None) -> None:
        self._file = _standard_input() if file is None else file
        self.is_terminal = os.isatty(self._file)
        self.is_closed = False
        self._before: list[Any] | None = None

    def __enter__(self) -> "Terminal":
        """Read keys as they are pressed."""
        if self.is_terminal:
            self._before = termios.tcgetattr(self._file)
            tty.setcbreak(self._file)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the terminal as it was found."""
        if self._before is not None:
            with contextlib.suppress(termios.error):  # it may have been hung up
                termios.tcsetattr(self._file, termios.TCSADRAIN, self._before)

    def keys(self) -> tuple[str, ...]:
        """Keys pressed since the last call: a letter in lower case, a digit, ``enter``, ``space`` or ``backspace``."""
        if not self.is_terminal or self.is_closed:
            return ()
        if not select.select([self._file], [], [], 0)[0]:
            return ()
        try:
            typed = os.read(self._file, 4096)
        except OSError:
            typed = b""
        self.is_closed = not typed
        return key_names(typed.decode("ascii", errors="ignore"))


def _standard_input() -> int:
    """Its file descriptor; -1, which is no terminal, if there is none."""
    try:
        return sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):  # closed, or something else stands for it
        return -1


def key_names(typed: str) -> tuple[str, ...]:
    """Names of the keys in what a terminal sent; arrow and function keys come as sequences and are left out."""
    names: list[str] = []
    position = 0
    while position < len(typed):
        letter = typed[position]
        position = _end_of_sequence(typed, position) if letter == _ESCAPE else position + 1
        if letter in _NAMES:
            names.append(_NAMES[letter])
        elif letter.isalnum():
            names.append(letter.lower())
    return tuple(names)


def _end_of_sequence(typed: str, start: int) -> int:
    """Where an escape sequence is over: ESC alone, ESC and a letter, or ESC [ parameters and a letter."""
    end = start + 1
    if typed[end : end + 1] in ("[", "O"):
        end += 1
        while end < len(typed) and not typed[end].isalpha() and typed[end] != "~":
            end += 1
        end += 1
    return end
