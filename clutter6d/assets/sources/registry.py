"""Asset sources by name: whatever packages register under the entry-point group ``clutter6d.asset_sources``."""

import inspect
from importlib.metadata import entry_points
from typing import Any

from clutter6d.assets.sources.base import AssetSource
from clutter6d.errors import InvalidValueError, UnknownNameError

SOURCE_GROUP = "clutter6d.asset_sources"


def source_names() -> tuple[str, ...]:
    """Names of all installed sources, sorted."""
    return tuple(sorted(entry.name for entry in entry_points(group=SOURCE_GROUP)))


def make_source(name: str, *, limit: int | None = None, **options: Any) -> AssetSource:
    """Make the source of a name.

    Args:
        name: Its name.
        limit: How many objects are wanted; told to a source that takes a ``count``.
        options: Passed to the source.

    Raises:
        UnknownNameError: No such source is installed.
        InvalidValueError: The source does not take one of the options.
    """
    found = {entry.name: entry for entry in entry_points(group=SOURCE_GROUP)}
    if name not in found:
        raise UnknownNameError("asset source", name, found)
    factory = found[name].load()
    taken = inspect.signature(factory).parameters
    for option in options:
        if option not in taken:
            raise InvalidValueError(f"asset source '{name}' does not take '{option}' (it takes: {', '.join(taken)})")
    if limit is not None and "count" in taken:
        options["count"] = limit
    return factory(**options)
