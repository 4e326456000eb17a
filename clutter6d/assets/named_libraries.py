"""Asset libraries by name: ``procedural`` stands for a library of built-in objects, made once in the user's cache.

Its folder is named after what its objects are made from, so another version of this package makes another one.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path

from clutter6d import __version__
from clutter6d.assets.cache import cache_folder
from clutter6d.assets.library import LIBRARY_FILE, AssetLibrary
from clutter6d.assets.processing import ProcessingSettings
from clutter6d.assets.run import RunSettings, fingerprint_of, run, settings_as_stored
from clutter6d.assets.sources.procedural import ProceduralSource
from clutter6d.errors import UnknownNameError
from clutter6d.executor import LOCAL, Executor
from clutter6d.schema import canonical_json

DEFAULT_LIBRARY = "procedural"
DEFAULT_OBJECTS = 96


def open_library(
    name_or_folder: str,
    *,
    workers: int = 1,
    executor: Executor = LOCAL,
    on_progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> AssetLibrary:
    """The library that a ``--library`` option means; the built-in one is made, or completed, if need be.

    Args:
        name_or_folder: A library's folder, or ``procedural``.
        workers: Processes that make it.
        executor: Where they are.
        on_progress: Called with the objects done and their total as a library is made.

    Raises:
        UnknownNameError: Neither a library's folder nor its name.
        StorageError: The cache cannot be written.
    """
    if (Path(name_or_folder) / LIBRARY_FILE).is_file():
        return AssetLibrary.open(name_or_folder)
    if name_or_folder != DEFAULT_LIBRARY:
        raise UnknownNameError("asset library (and no folder of one)", name_or_folder, [DEFAULT_LIBRARY])
    return _make_default_library(RunSettings(workers=workers, executor=executor), on_progress)


def _make_default_library(run_settings: RunSettings, on_progress: Callable[[int, int], None]) -> AssetLibrary:
    settings, source = ProcessingSettings(), ProceduralSource()
    items = source.objects()[:DEFAULT_OBJECTS]
    content = [[fingerprint_of(source, item, settings) for item in items], __version__]
    version = hashlib.sha256(canonical_json(content)).hexdigest()[:8]
    library = AssetLibrary.create(cache_folder() / f"{DEFAULT_LIBRARY}-{version}", settings_as_stored(settings))
    for done, _ in enumerate(run(source, items, library, settings, run_settings), start=1):
        on_progress(done, len(items))
    return library
