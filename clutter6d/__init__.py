"""Clutter6D: scenes, simulation and evaluation for 6-D object rearrangement in clutter."""

from typing import TYPE_CHECKING

from clutter6d.envs.registration import register_with_gymnasium

if TYPE_CHECKING:
    from clutter6d.dataset.split import Split

__version__ = "0.1.0"
__all__ = ["__version__", "load_split"]

register_with_gymnasium()


def load_split(name: str) -> "Split":
    """A frozen split of the benchmark, read lazily: index it, iterate over it, or call ``to_pandas()``.

    Args:
        name: ``"sparse-train"``, ``"sparse-test"``, ``"moderate-test"`` or ``"dense-test"`` of Clutter6D v1; a split of
            another data set has that data set's name or folder before it: ``"clutter6d-real-v1/dense-test"``.

    Raises:
        UnknownNameError: There is no such split.
        InvalidFileError: Its file is not the one that was frozen.
    """
    from clutter6d.dataset.scenes import load_split as load

    return load(name)
