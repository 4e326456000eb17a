"""Every error Clutter6D raises on purpose.

Clutter6DError                     exit code 1: the machine's or our own fault
├── StorageError                   a file could not be written (disk full, no permission)
├── SimulationError                the physics became invalid (NaN, out of memory)
├── GenerationError                no valid scene was found within the allowed attempts
├── MeshRejectedError              a mesh cannot become an asset; carries its reason
└── UserError                      exit code 2: the caller can mend it
    ├── InvalidValueError          an argument out of range
    ├── UnknownNameError           a name that is not on the list; suggests the nearest
    ├── MissingFileError           a path that is not there
    ├── InvalidFileError           a file that is there and is not what it should be
    └── MissingDependencyError     an optional package or system library that is not installed

A message says what went wrong, where, and what to do, in one line.
"""

import difflib
from collections.abc import Iterable
from pathlib import Path


class Clutter6DError(Exception):
    """Base of all errors of this package."""

    exit_code = 1


class StorageError(Clutter6DError):
    """A file could not be written."""


class SimulationError(Clutter6DError):
    """The simulation produced an invalid state."""


class GenerationError(Clutter6DError):
    """No valid scene was found within the allowed attempts."""


class MeshRejectedError(Clutter6DError):
    """A mesh cannot become an asset.

    Args:
        reason: Short machine-readable reason, as counted in processing reports.
        detail: What exactly was found.
    """

    def __init__(self, reason: str, detail: str) -> None:
        super().__init__(f"{reason}: {detail}")
        self.reason = reason
        self.detail = detail

    def __reduce__(self) -> tuple[type["MeshRejectedError"], tuple[str, str]]:
        """Pickle by the two arguments, since the error crosses process borders."""
        return type(self), (self.reason, self.detail)


class UserError(Clutter6DError):
    """A mistake the caller can mend."""

    exit_code = 2


class InvalidValueError(UserError):
    """An argument is out of its allowed range."""


class UnknownNameError(UserError):
    """A name is not among the known ones.

    Args:
        kind: What is named, for instance ``"track"``.
        name: What came.
        known: What is allowed.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        choices = sorted(known)
        close = difflib.get_close_matches(name, choices, n=1)
        hint = f"; did you mean '{close[0]}'?" if close else ""
        shown = ", ".join(choices[:20]) + (", ..." if len(choices) > 20 else "")
        super().__init__(f"unknown {kind} '{name}'{hint} (known: {shown or 'none'})")
        self._arguments = (kind, name, tuple(choices))

    def __reduce__(self) -> tuple[type["UnknownNameError"], tuple[str, str, tuple[str, ...]]]:
        """Pickle by the constructor's arguments."""
        return type(self), self._arguments


class MissingFileError(UserError):
    """A path does not exist."""

    def __init__(self, what: str, path: Path | str, hint: str = "") -> None:
        super().__init__(f"{what} not found: {path}" + (f"; {hint}" if hint else ""))
        self._arguments = (what, path, hint)

    def __reduce__(self) -> tuple[type["MissingFileError"], tuple[str, Path | str, str]]:
        """Pickle by the constructor's arguments."""
        return type(self), self._arguments


class InvalidFileError(UserError):
    """A file exists and its content is not acceptable."""

    def __init__(self, path: Path | str, problem: str) -> None:
        super().__init__(f"{path}: {problem}")
        self._arguments = (path, problem)

    def __reduce__(self) -> tuple[type["InvalidFileError"], tuple[Path | str, str]]:
        """Pickle by the constructor's arguments."""
        return type(self), self._arguments


class MissingDependencyError(UserError):
    """An optional dependency is not installed."""
