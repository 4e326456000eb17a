"""What ``reset(options=...)`` may name."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from clutter6d.envs.slots import Slots
from clutter6d.errors import InvalidValueError, UnknownNameError

KNOWN: Final = ("reset_mask", "scene_id", "pair")


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ResetOptions:
    """Which environments are reset, and to what.

    Attributes:
        slots: The environments.
        chosen: Scene and pair of each of them; ``None``: drawn.
    """

    slots: Slots
    chosen: tuple[tuple[str, int], ...] | None


def read_reset_options(options: Mapping[str, Any] | None, size: int) -> ResetOptions:
    """Check what the caller gave.

    Args:
        options: ``reset_mask``: which environments, booleans, default all; ``scene_id`` and ``pair``, both or neither:
            one for all, or one for each environment.
        size: Number of environments.

    Raises:
        UnknownNameError: Another option.
        InvalidValueError: A value of another type or size.
    """
    options = options or {}
    for name in options:
        if name not in KNOWN:
            raise UnknownNameError("reset option", str(name), KNOWN)
    slots = _read_mask(options["reset_mask"], size) if "reset_mask" in options else np.arange(size)
    if ("scene_id" in options) != ("pair" in options):
        raise InvalidValueError("reset options: give scene_id and pair together")
    if "scene_id" not in options:
        return ResetOptions(slots=slots, chosen=None)
    scenes, pairs = (_one_each(name, options[name], size) for name in ("scene_id", "pair"))
    return ResetOptions(slots=slots, chosen=tuple((str(scenes[slot]), _index(pairs[slot])) for slot in slots))


def _read_mask(value: object, size: int) -> Slots:
    if not isinstance(value, np.ndarray) or value.dtype != bool or value.shape != (size,) or not value.any():
        raise InvalidValueError(f"reset option reset_mask: give a boolean array of {size} entries, not all false")
    return np.flatnonzero(value)


def _one_each(name: str, value: Any, size: int) -> list[Any]:
    if isinstance(value, (str, int, np.integer)):
        return [value] * size
    try:
        values = list(value)
    except TypeError:
        raise InvalidValueError(f"reset option {name}: give one value, or {size} of them, not {value!r}") from None
    if len(values) != size:
        raise InvalidValueError(f"reset option {name}: {len(values)} values for {size} environments")
    return values


def _index(value: Any) -> int:
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise InvalidValueError(f"reset option pair: {value!r} is not a whole number")
    return int(value)
