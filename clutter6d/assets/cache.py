"""Where things are kept that this package makes once for its user."""

import os
from pathlib import Path

CACHE_VARIABLE = "CLUTTER6D_CACHE"


def cache_folder() -> Path:
    """``$CLUTTER6D_CACHE``, or ``clutter6d`` in the user's cache folder."""
    if CACHE_VARIABLE in os.environ:
        return Path(os.environ[CACHE_VARIABLE])
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "clutter6d"
