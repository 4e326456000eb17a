"""Gymnasium's ids; ``import clutter6d`` registers them.

Gymnasium loads NumPy, which the commands' help can do without. So the ids are registered when Gymnasium is imported,
before or after this package.
"""

import importlib.util
import sys
from collections.abc import Iterable
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, Final

DEFAULT_SPLITS: Final = {"sparse": "sparse-train", "moderate": "moderate-test", "dense": "dense-test"}
"""The split of each track that an environment draws from unless another is named."""


def register_with_gymnasium() -> None:
    """Register the environments now if Gymnasium is loaded, else as soon as it is."""
    if "gymnasium" in sys.modules:
        _register()
    else:
        sys.meta_path.insert(0, _GymnasiumFinder())


def _register() -> None:
    import gymnasium

    for track, split in DEFAULT_SPLITS.items():
        gymnasium.register(
            id=f"Clutter6D-{track.capitalize()}-v1",
            entry_point="clutter6d.envs.clutter_env:ClutterEnv",
            vector_entry_point="clutter6d.envs.devices:make_vector_env",
            kwargs={"track": track, "split": split},
        )


class _GymnasiumFinder(MetaPathFinder):
    """Finds Gymnasium as Python does, and registers the environments when it has been loaded."""

    def find_spec(
        self, fullname: str, path: Iterable[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The specification of Gymnasium; leaves every other module to others."""
        del path, target
        if fullname != "gymnasium":
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(fullname)
        if spec is not None and spec.loader is not None:
            loader: Any = spec.loader
            execute = loader.exec_module

            def execute_and_register(module: ModuleType) -> None:
                execute(module)
                _register()

            loader.exec_module = execute_and_register
        return spec
