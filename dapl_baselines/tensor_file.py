"""Files of tensors and plain values, read without ever running what they contain.

A file is what ``torch.save`` writes of a dictionary. It is unpickled by PyTorch's restricted reader alone
(``weights_only=True``), after its size and its entries have been looked at. This is the one place that calls
``torch.load``; what a dictionary must hold is for the reader's caller to check.
"""

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import torch

from clutter6d.errors import InvalidFileError, MissingFileError
from clutter6d.schema import write_bytes

MAX_FILE_BYTES = 2 << 30
MAX_PICKLE_BYTES = 16 << 20


def write_tensor_file(path: Path, content: Mapping[str, object]) -> None:
    """Write a dictionary of tensors and plain values (numbers, strings, lists, dictionaries), atomically.

    Raises:
        StorageError: The file cannot be written.
    """
    buffer = io.BytesIO()
    torch.save(dict(content), buffer)
    write_bytes(path, buffer.getvalue())


def read_tensor_file(path: Path, *, what: str = "checkpoint") -> dict[str, Any]:
    """The dictionary in a file; tensors are on the CPU.

    Args:
        path: The file.
        what: What it should be, for messages.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is too large, is no such file, or holds more than tensors and plain values.
    """
    _check_container(path, what)
    return _restricted_load(path, what)


def _check_container(path: Path, what: str) -> None:
    """It must be an uncompressed archive of bounded size with a small pickle in it."""
    if not path.is_file():
        raise MissingFileError(what, path)
    size = path.stat().st_size
    if size > MAX_FILE_BYTES:
        raise InvalidFileError(path, f"{size:,} bytes are more than the {MAX_FILE_BYTES:,} allowed for a {what}")
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, ValueError, OSError, NotImplementedError) as error:
        raise InvalidFileError(path, f"not a {what}: {error}") from None
    if any(member.compress_type != zipfile.ZIP_STORED or member.file_size > size for member in members):
        raise InvalidFileError(path, f"not a {what}: an entry is compressed or larger than the file")
    if any(member.filename.endswith(".pkl") and member.file_size > MAX_PICKLE_BYTES for member in members):
        raise InvalidFileError(path, f"its structure takes more than the {MAX_PICKLE_BYTES:,} bytes allowed")


def _restricted_load(path: Path, what: str) -> dict[str, Any]:
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # noqa: BLE001  a hostile file may provoke anything; none of it may escape
        reason = " ".join(str(error).split())
        if "Unsupported" in reason or "weights_only" in reason.lower():
            reason = "it holds something else than plain values and tensors, which could run code"
        raise InvalidFileError(path, f"not a {what}, refused: {reason[:200]}") from None
    if not isinstance(content, dict) or not all(isinstance(key, str) for key in cast(dict[Any, Any], content)):
        raise InvalidFileError(path, f"not a {what}: it holds no dictionary of names")
    return cast(dict[str, Any], content)
