"""Messages of the inference server: MessagePack with NumPy's arrays, as openpi's clients and servers write them.

An array is a map with the byte-string keys ``__ndarray__`` (true), ``dtype`` (NumPy's name with the byte order, such as
``<f4``), ``shape`` and ``data`` (the elements in C order). Nothing but plain values and arrays of numbers can be
written or read: no objects, no code. Needs NumPy and msgpack alone.
"""

from math import prod
from typing import Any, Final, TypeGuard, cast

import msgpack
import numpy as np

MAX_MESSAGE_BYTES: Final = 256 << 10
"""Longest message; an observation takes 36 kB."""

DTYPES: Final = {
    name: np.dtype(name) for name in ("|b1", "|u1", "|i1", "<u2", "<i2", "<u4", "<i4", "<i8", "<f2", "<f4", "<f8")
}
"""What the elements of an array may be."""

_MARK: Final = b"__ndarray__"
_KEYS: Final = {_MARK, b"dtype", b"shape", b"data"}
_MAX_AXES: Final = 8


class WireError(ValueError):
    """A message is not what it should be; says what is wrong in one line."""


def pack(value: object) -> bytes:
    """A message.

    Args:
        value: Plain values, lists, maps, and arrays of numbers.

    Raises:
        WireError: It holds something else.
    """
    try:
        return cast(bytes, msgpack.packb(value, default=_array_to_map))
    except (TypeError, ValueError, OverflowError) as error:
        raise WireError(f"cannot be sent: {_one_line(error)}") from None


def unpack(message: bytes | str) -> object:
    """What a message holds; arrays are views of it that cannot be written to.

    Raises:
        WireError: It is text, is not complete, or holds an array of something else than numbers.
    """
    if isinstance(message, str):
        raise WireError("a text message; expected MessagePack in a binary one")
    try:
        return msgpack.unpackb(message, object_hook=_map_to_array)
    except WireError:
        raise
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        raise WireError(f"not a MessagePack message: {_one_line(error)}") from None


def describe(value: object) -> str:
    """A value for an error message: ``float32(512, 7)``, or the name of its type."""
    return f"{value.dtype}{value.shape}" if isinstance(value, np.ndarray) else type(value).__name__


def _array_to_map(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    if not isinstance(value, np.ndarray):
        raise TypeError(f"a {type(value).__name__} is neither a plain value nor an array")
    if value.dtype.str not in DTYPES:
        raise TypeError(f"an array of {value.dtype} is not one of {', '.join(DTYPES)}")
    return {_MARK: True, b"dtype": value.dtype.str, b"shape": value.shape, b"data": value.tobytes()}


def _map_to_array(value: dict[Any, Any]) -> object:
    if _MARK not in value:
        return value
    dtype, shape, data = (value.get(key) for key in (b"dtype", b"shape", b"data"))
    if set(value) != _KEYS or not isinstance(dtype, str) or dtype not in DTYPES or not isinstance(data, bytes):
        raise WireError(f"holds an array that is not made of numbers; allowed are {', '.join(DTYPES)}")
    if not _is_shape(shape) or prod(shape) * DTYPES[dtype].itemsize != len(data):
        raise WireError(f"holds an array whose shape and {len(data):,} bytes of data do not fit")
    return np.frombuffer(data, dtype=DTYPES[dtype]).reshape(shape)


def _is_shape(shape: object) -> TypeGuard[list[int]]:
    if not isinstance(shape, list) or len(cast(list[object], shape)) > _MAX_AXES:
        return False
    return all(type(size) is int and size >= 0 for size in cast(list[object], shape))


def _one_line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:200]
