"""The hash of this project's code, which every training keeps beside its settings."""

import hashlib
from functools import cache
from pathlib import Path
from typing import Final

_PACKAGES: Final = ("clutter6d", "dapl_baselines")


@cache
def code_sha256() -> str:
    """SHA-256 over path and content of every Python file of the toolkit and the baselines."""
    root, digest = Path(__file__).parents[1], hashlib.sha256()
    for path in sorted(path for package in _PACKAGES for path in (root / package).rglob("*.py")):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(root).as_posix()} {len(content)}\n".encode() + content)
    return digest.hexdigest()
