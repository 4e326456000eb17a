"""Keyed random generators: every random choice is named, so anything regenerates alone and in any order."""

import hashlib
from typing import SupportsIndex

import numpy as np


def seed_words(seed: SupportsIndex, *path: str | SupportsIndex) -> tuple[int, ...]:
    """Eight 32-bit words that depend on the seed and on every element of the path."""
    name = (int(seed), *(str(part) if isinstance(part, str) else int(part) for part in path))
    digest = hashlib.sha256(repr(name).encode()).digest()
    return tuple(int.from_bytes(digest[i : i + 4], "little") for i in range(0, 32, 4))


def generator(seed: SupportsIndex, *path: str | SupportsIndex) -> np.random.Generator:
    """The generator that belongs to one named choice.

    Args:
        seed: The user's seed.
        path: What is drawn, from general to particular, for instance ``("dense", scene_index, "placement")``; NumPy's
            integers and Python's name the same.

    Returns:
        A PCG64 generator; equal arguments give equal streams on every platform.
    """
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed_words(seed, *path))))
