"""Checkpoints: one ``.pt`` file that is read without ever running what it contains.

The file is what ``torch.save`` writes of a plain dictionary: a header of JSON-like values (:class:`CheckpointHeader`)
beside a ``state_dict`` of tensors. It is unpickled by PyTorch's restricted reader alone (``weights_only=True``), after
its size has been looked at, and believed only when header, names, shapes and values are those of its architecture.
"""

import hashlib
import io
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, cast

from pydantic import Field, JsonValue, ValidationError

from clutter6d import __version__
from clutter6d.errors import InvalidFileError, MissingDependencyError, MissingFileError, UnknownNameError
from clutter6d.eval.policy import Policy, PolicyOptions
from clutter6d.schema import FileModel, canonical_json, write_bytes

try:
    import torch
    from torch import Tensor, nn
except ModuleNotFoundError:
    raise MissingDependencyError("checkpoints need PyTorch: pip install 'clutter6d[baselines]'") from None

from dapl_baselines.state_policy import StateMlp, StateMlpConfig, StatePolicy

FORMAT: Literal["clutter6d-checkpoint"] = "clutter6d-checkpoint"
MAX_FILE_BYTES = 2 << 30
MAX_PICKLE_BYTES = 16 << 20


class TrainingRecord(FileModel):
    """One stretch of training.

    Attributes:
        method: For instance ``"ppo"`` or ``"distillation"``.
        steps: Environment steps or optimiser steps, as ``unit`` says.
        unit: What ``steps`` counts.
        seed: Seed of the training.
        split_sha256: Hash of the scenes it was trained on; empty if none.
        settings: The training's configuration, as plain values.
    """

    schema_version: Literal[1] = 1
    method: str
    steps: int = Field(ge=0)
    unit: str
    seed: int
    split_sha256: str = ""
    settings: dict[str, JsonValue] = Field(default_factory=dict)


class CheckpointHeader(FileModel):
    """Everything in a checkpoint but its tensors.

    Attributes:
        format: Marks the file as ours.
        architecture: Name in ``ARCHITECTURES``.
        config: The architecture's configuration.
        history: How the weights came about, first to last.
        weights_sha256: Hash of the tensors.
        clutter6d: Version that wrote the file.
    """

    schema_version: Literal[1] = 1
    format: Literal["clutter6d-checkpoint"]
    architecture: str
    config: dict[str, JsonValue]
    history: tuple[TrainingRecord, ...] = ()
    weights_sha256: str = Field(pattern="^[0-9a-f]{64}$")
    clutter6d: str

    def policy_hash(self) -> str:
        """SHA-256 over what its actions depend on: architecture, configuration, weights."""
        return hashlib.sha256(canonical_json([self.architecture, self.config, self.weights_sha256])).hexdigest()


@dataclass(frozen=True, kw_only=True, slots=True)
class Architecture:
    """How a named architecture is built.

    Attributes:
        config: Model of its configuration.
        build: Configuration to module.
        to_policy: Module and policy hash to policy.
    """

    config: type[FileModel]
    build: Callable[[Any], nn.Module]
    to_policy: Callable[[Any, str], Policy]


ARCHITECTURES: Mapping[str, Architecture] = {
    "state-mlp": Architecture(config=StateMlpConfig, build=StateMlp, to_policy=StatePolicy),
}


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Checkpoint:
    """A checkpoint as read: its header, and its module with the weights in place."""

    header: CheckpointHeader
    module: nn.Module


def load_checkpoint_policy(path: Path, options: PolicyOptions) -> Policy:  # noqa: ARG001  every loader takes them
    """The policy in a checkpoint.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is not an acceptable checkpoint.
        UnknownNameError: Its architecture is not known.
    """
    checkpoint = read_checkpoint(path)
    return ARCHITECTURES[checkpoint.header.architecture].to_policy(checkpoint.module, checkpoint.header.policy_hash())


def write_checkpoint(
    path: Path,
    *,
    architecture: str,
    config: FileModel,
    module: nn.Module,
    history: tuple[TrainingRecord, ...] = (),
) -> CheckpointHeader:
    """Write a checkpoint, atomically.

    Raises:
        UnknownNameError: The architecture is not in the registry.
        StorageError: The file cannot be written.
    """
    _find_architecture(architecture)
    weights = {name: tensor.detach().cpu().contiguous() for name, tensor in module.state_dict().items()}
    header = CheckpointHeader(
        format=FORMAT,
        architecture=architecture,
        config=config.model_dump(mode="json"),
        history=history,
        weights_sha256=weights_sha256(weights),
        clutter6d=__version__,
    )
    buffer = io.BytesIO()
    torch.save({**header.model_dump(mode="json"), "state_dict": weights}, buffer)
    write_bytes(path, buffer.getvalue())
    return header


def read_checkpoint(path: Path) -> Checkpoint:
    """Read and check a checkpoint; nothing in it is executed.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is too large, no checkpoint of ours, or does not fit its architecture.
        UnknownNameError: Its architecture is not known.
    """
    _check_container(path)
    content = _restricted_load(path)
    weights = content.pop("state_dict", None)
    try:
        header = CheckpointHeader.model_validate(content)
        architecture = _find_architecture(header.architecture)
        config = architecture.config.model_validate(header.config)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"]) or "header"
        raise InvalidFileError(path, f"not a valid checkpoint: {field}: {first['msg']}") from None
    with torch.device("meta"):
        expected = architecture.build(config).state_dict()
    checked = _check_weights(path, weights, expected)
    if weights_sha256(checked) != header.weights_sha256:
        raise InvalidFileError(path, "not a valid checkpoint: its weights are not those it was written with")
    module = architecture.build(config)
    module.load_state_dict(checked)
    return Checkpoint(header=header, module=module)


def weights_sha256(weights: Mapping[str, Tensor]) -> str:
    """Hash over names, types, shapes and values of tensors."""
    digest = hashlib.sha256()
    for name in sorted(weights):
        array = weights[name].contiguous().numpy()
        digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def _find_architecture(name: str) -> Architecture:
    if name not in ARCHITECTURES:
        raise UnknownNameError("checkpoint architecture", name, ARCHITECTURES)
    return ARCHITECTURES[name]


def _check_container(path: Path) -> None:
    """A checkpoint is an uncompressed archive of bounded size with a small pickle in it."""
    if not path.is_file():
        raise MissingFileError("checkpoint", path)
    size = path.stat().st_size
    if size > MAX_FILE_BYTES:
        raise InvalidFileError(path, f"{size:,} bytes are more than the {MAX_FILE_BYTES:,} allowed for a checkpoint")
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, ValueError, OSError, NotImplementedError) as error:
        raise InvalidFileError(path, f"not a checkpoint: {error}") from None
    if any(member.compress_type != zipfile.ZIP_STORED or member.file_size > size for member in members):
        raise InvalidFileError(path, "not a checkpoint: an entry is compressed or larger than the file")
    if any(member.filename.endswith(".pkl") and member.file_size > MAX_PICKLE_BYTES for member in members):
        raise InvalidFileError(path, f"its structure takes more than the {MAX_PICKLE_BYTES:,} bytes allowed")


def _restricted_load(path: Path) -> dict[str, Any]:
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # noqa: BLE001  a hostile file may provoke anything; none of it may escape
        reason = " ".join(str(error).split())
        if "Unsupported" in reason or "weights_only" in reason.lower():
            reason = "it holds something else than plain values and tensors, which could run code"
        raise InvalidFileError(path, f"not a checkpoint, refused: {reason[:200]}") from None
    if not isinstance(content, dict) or not all(isinstance(key, str) for key in cast(dict[Any, Any], content)):
        raise InvalidFileError(path, "not a checkpoint: it holds no dictionary of names")
    return cast(dict[str, Any], content)


def _check_weights(path: Path, weights: object, expected: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The state dict, if it has exactly the names, shapes and types of its architecture and is finite."""
    if not isinstance(weights, dict):
        raise InvalidFileError(path, "not a valid checkpoint: 'state_dict' is missing")
    found = cast(dict[object, object], weights)
    if set(found) != set(expected):
        names = sorted(str(name) for name in set(found) ^ set(expected))
        raise InvalidFileError(path, f"not a valid checkpoint: tensor '{names[0]}' is missing or does not belong there")
    checked: dict[str, Tensor] = {}
    for name, wanted in expected.items():
        tensor = found[name]
        if not isinstance(tensor, Tensor) or tensor.layout != torch.strided or tensor.device.type != "cpu":
            raise InvalidFileError(path, f"not a valid checkpoint: '{name}' is not a dense tensor")
        if tensor.shape != wanted.shape or tensor.dtype != wanted.dtype:
            shapes = f"{tensor.dtype}{tuple(tensor.shape)}, expected {wanted.dtype}{tuple(wanted.shape)}"
            raise InvalidFileError(path, f"not a valid checkpoint: tensor '{name}' is {shapes}")
        if tensor.is_floating_point() and not bool(torch.isfinite(tensor).all()):
            raise InvalidFileError(path, f"not a valid checkpoint: tensor '{name}' holds values that are not finite")
        checked[name] = tensor
    return checked
