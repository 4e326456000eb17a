"""Presets, and what a user chose instead of some of their values."""

from collections.abc import Mapping
from typing import TypeVar

from pydantic import ValidationError

from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.schema import FileModel

Settings = TypeVar("Settings", bound=FileModel)


def find_preset(presets: Mapping[str, Settings], name: str) -> Settings:
    """The settings of a name.

    Raises:
        UnknownNameError: There are none.
    """
    if name not in presets:
        raise UnknownNameError("preset", name, presets)
    return presets[name]


def with_choices(preset: Settings, **chosen: object) -> Settings:
    """Settings with some values in place of the preset's.

    Args:
        preset: The settings without them.
        chosen: Values by name; ``None``: nothing was chosen.

    Raises:
        InvalidValueError: A value is not allowed.
    """
    given = {name: value for name, value in chosen.items() if value is not None}
    try:
        return type(preset).model_validate(preset.model_dump() | given)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name = ".".join(str(part) for part in first["loc"]) or "settings"
        raise InvalidValueError(f"{name} is {first['input']}: {first['msg']}") from None
