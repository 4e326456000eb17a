"""Folders that belong to one training or recording: whoever goes on in one must want what was begun there."""

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import cast

from clutter6d.errors import InvalidValueError
from clutter6d.schema import FileModel, read_model, write_model


def claim(path: Path, record: FileModel, *, what: str, may_change: Collection[str] = ()) -> None:
    """Make a folder that of a record, or find that it already is.

    Args:
        path: The record's file in the folder.
        record: Everything that the folder's content depends on.
        what: What the folder is of, for messages.
        may_change: Values that may be others when it goes on, by their path in the record, as ``settings.iterations``.

    Raises:
        InvalidValueError: It is of something begun with other settings, or of something else.
        InvalidFileError: The record in it is damaged.
        StorageError: It cannot be written.
    """
    out = path.parent
    if path.is_file():
        before, now = _by_path(read_model(path, type(record), what=what)), _by_path(record)
        for name in before | now:
            if before.get(name) != now.get(name) and name not in may_change:
                change = f"{name} was {before.get(name)}, is {now.get(name)}"
                raise InvalidValueError(f"{out} is of a {what} with other settings ({change}); choose another --out")
    elif out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InvalidValueError(f"{out} is neither an empty folder nor a {what}; choose another --out")
    write_model(path, record)


def _by_path(record: FileModel) -> dict[str, object]:
    """All values of a record by their path in it."""

    def walk(path: str, value: object) -> Iterator[tuple[str, object]]:
        if not isinstance(value, dict):
            yield path, value
            return
        for name, part in cast(dict[str, object], value).items():
            yield from walk(f"{path}.{name}" if path else name, part)

    return dict(walk("", record.model_dump(mode="json")))
