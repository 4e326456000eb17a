"""Files at the package's edge: versioned JSON models and plain arrays, read with suspicion and written atomically."""

import contextlib
import io
import json
import os
import secrets
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from clutter6d.errors import InvalidFileError, InvalidValueError, MissingFileError, StorageError

MAX_JSON_BYTES = 64 << 20
MAX_ARRAYS_BYTES = 256 << 20


class FileModel(BaseModel):
    """Base of every model that is stored in a file: frozen, without unknown fields, without NaN.

    Subclasses declare ``schema_version: Literal[1] = 1``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


Model = TypeVar("Model", bound=FileModel)


def read_bytes(path: Path, *, what: str, max_bytes: int = MAX_JSON_BYTES) -> bytes:
    """The content of a file that is no larger than it may be.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is too large or cannot be read.
    """
    try:
        size = path.stat().st_size
        if size > max_bytes:
            raise InvalidFileError(path, f"{size:,} bytes are more than the {max_bytes:,} allowed for a {what}")
        return path.read_bytes()
    except FileNotFoundError:
        raise MissingFileError(what, path) from None
    except OSError as error:
        raise InvalidFileError(path, f"cannot be read: {error.strerror}") from None


def read_model(path: Path, model: type[Model], *, what: str, max_bytes: int = MAX_JSON_BYTES) -> Model:
    """Read and check one JSON file.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is not JSON, or not this model; the message names the first offending field.
    """
    content = read_bytes(path, what=what, max_bytes=max_bytes)
    try:
        return model.model_validate_json(content, strict=False)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"]) or "(whole file)"
        raise InvalidFileError(path, f"not a valid {what}: {field}: {first['msg']}") from None
    except RecursionError:
        raise InvalidFileError(path, f"not a valid {what}: nested too deeply") from None


def write_model(path: Path, model: FileModel) -> None:
    """Write one model as indented JSON, atomically; floats round-trip exactly."""
    write_bytes(path, model_bytes(model))


def model_bytes(model: FileModel) -> bytes:
    """A model as it is written."""
    return (model.model_dump_json(indent=1) + "\n").encode()


def write_bytes(path: Path, content: bytes) -> None:
    """Replace a file atomically: after a crash it holds the old content or the new, never a part.

    Raises:
        InvalidValueError: A file stands where a folder should be, or a folder where the file should.
        StorageError: The disk is full, or the folder cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}.partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except (FileExistsError, NotADirectoryError, IsADirectoryError):
        in_the_way = path if path.is_dir() else next(parent for parent in path.parents if parent.exists())
        kind = "folder" if in_the_way.is_dir() else "file"
        raise InvalidValueError(
            f"cannot write {path}: the {kind} {in_the_way} is in the way; choose another place"
        ) from None
    except OSError as error:
        raise StorageError(f"cannot write {path}: {error.strerror}; nothing earlier was changed") from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()


@dataclass(frozen=True, kw_only=True, slots=True)
class ArraySpec:
    """What an array in a file must be: its dtype and shape, with ``None`` for a free axis."""

    dtype: str
    shape: tuple[int | None, ...]

    def matches(self, array: np.ndarray) -> bool:
        """Whether dtype and shape fit."""
        return (
            array.dtype == np.dtype(self.dtype)
            and array.ndim == len(self.shape)
            and all(want in (None, got) for want, got in zip(self.shape, array.shape, strict=True))
        )


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write named arrays to one compressed ``.npz``, atomically."""
    write_bytes(path, array_bytes(arrays))


def array_bytes(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Named arrays as they are written; equal arrays give equal bytes."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **dict(arrays))
    return buffer.getvalue()


def read_arrays(path: Path, specs: Mapping[str, ArraySpec], *, what: str) -> dict[str, np.ndarray]:
    """Read the named arrays of an ``.npz``; nothing is unpickled and nothing larger than allowed is unpacked.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is no archive of exactly these arrays, is too large when unpacked, or holds NaN.
    """
    content = read_bytes(path, what=what, max_bytes=MAX_ARRAYS_BYTES)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if sum(member.file_size for member in archive.infolist()) > MAX_ARRAYS_BYTES:
                raise InvalidFileError(path, f"unpacks to more than {MAX_ARRAYS_BYTES:,} bytes")
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            if set(file.files) != set(specs):
                raise InvalidFileError(path, f"holds arrays {sorted(file.files)}, expected {sorted(specs)}")
            arrays = {name: file[name] for name in specs}
    except (zipfile.BadZipFile, ValueError, EOFError, KeyError, OSError, NotImplementedError, MemoryError) as error:
        raise InvalidFileError(path, f"not a valid {what}: {error}") from None
    for name, spec in specs.items():
        check_array(path, name, arrays[name], spec)
    return arrays


def check_array(path: Path, name: str, array: np.ndarray, spec: ArraySpec) -> None:
    """Refuse an array of a file that is not what it must be.

    Raises:
        InvalidFileError: It has another type or shape, or values that are not finite.
    """
    if not spec.matches(array):
        found = f"{array.dtype}{array.shape}"
        raise InvalidFileError(path, f"array '{name}' is {found}, expected {spec.dtype}{spec.shape}")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise InvalidFileError(path, f"array '{name}' holds values that are not finite")


def canonical_json(value: object) -> bytes:
    """JSON with sorted keys and no spaces, for hashing."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()
