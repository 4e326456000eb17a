"""Asset libraries by name: a source's name stands for a library of its objects, made once in the user's cache."""

import os
from pathlib import Path

from clutter6d.assets.library import AssetLibrary
from clutter6d.errors import UnknownNameError

DEFAULT_LIBRARY = "procedural"
DEFAULT_OBJECTS = 96
CACHE_VARIABLE = "CLUTTER6D_CACHE"


def cache_folder() -> Path:
    """Where libraries made by name are kept: ``$CLUTTER6D_CACHE``, or ``clutter6d`` in the user's cache folder."""
    if CACHE_VARIABLE in os.environ:
        return Path(os.environ[CACHE_VARIABLE])
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "clutter6d"


def library_folder(name_or_folder: str) -> Path:
    """The folder that a ``--library`` option means.

    Raises:
        UnknownNameError: Neither a library's folder nor a name for one.
    """
    if (Path(name_or_folder) / "library.json").is_file():
        return Path(name_or_folder)
    if name_or_folder == DEFAULT_LIBRARY:
        return cache_folder() / f"{DEFAULT_LIBRARY}-{DEFAULT_OBJECTS}"
    raise UnknownNameError("asset library (no folder with a library.json either)", name_or_folder, [DEFAULT_LIBRARY])
