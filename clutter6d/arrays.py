"""Mathematics written once for NumPy and torch, by the Python array API standard.

A function of :data:`Array` works on arrays of any library that ``array-api-compat`` knows, on any device, and gives
arrays of the same library and floating type on the same device. Nothing here imports any of these libraries but NumPy.
"""

from functools import cache
from types import ModuleType
from typing import Any, TypeVar

from array_api_compat import array_namespace, device

_Numbers = tuple[float, ...] | tuple[tuple[float, ...], ...]

__all__ = ["Array", "constant", "namespace"]

Array = TypeVar("Array", bound=Any)
"""The arrays of one call: ``np.ndarray`` in, ``np.ndarray`` out; ``torch.Tensor`` in, ``torch.Tensor`` out."""


def namespace(array: Any) -> Any:
    """The array API functions of an array's library."""
    return array_namespace(array)


def constant(values: _Numbers, like: Array) -> Array:
    """Numbers as an array of another's library, floating type and device; made once, not to be written to."""
    return _constant(values, array_namespace(like), like.dtype, device(like))


@cache
def _constant(values: _Numbers, xp: ModuleType, dtype: Any, place: Any) -> Any:
    return xp.asarray(values, dtype=dtype, device=place)
