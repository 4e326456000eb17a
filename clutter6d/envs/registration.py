"""Gymnasium's ids; ``import clutter6d`` registers them."""

from typing import Final

import gymnasium

DEFAULT_SPLITS: Final = {"sparse": "sparse-train", "moderate": "moderate-test", "dense": "dense-test"}
"""The split of each track that an environment draws from unless another is named."""


def register_envs() -> None:
    """Register ``Clutter6D-Sparse-v1``, ``Clutter6D-Moderate-v1`` and ``Clutter6D-Dense-v1``."""
    for track, split in DEFAULT_SPLITS.items():
        gymnasium.register(
            id=f"Clutter6D-{track.capitalize()}-v1",
            entry_point="clutter6d.envs.clutter_env:ClutterEnv",
            vector_entry_point="clutter6d.envs.vector_env:ClutterVectorEnv",
            kwargs={"track": track, "split": split},
        )
