"""Checkpoints: one ``.pt`` file that is read without ever running what it contains.

The file is what ``torch.save`` writes of a plain dictionary: a header of JSON-like values (:class:`CheckpointHeader`)
beside a ``state_dict`` of tensors. It is read by :mod:`dapl_baselines.tensor_file` and believed only when header,
names, shapes and values are those of its architecture.
"""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, cast

from pydantic import Field, JsonValue, ValidationError

from clutter6d import __version__
from clutter6d.errors import InvalidFileError, InvalidValueError, MissingDependencyError, UnknownNameError
from clutter6d.eval.policy import Policy, PolicyOptions
from clutter6d.schema import FileModel, canonical_json

try:
    import torch
    from torch import Tensor, nn
except ModuleNotFoundError:
    raise MissingDependencyError("checkpoints need PyTorch: pip install 'clutter6d[baselines]'") from None

from dapl_baselines.contact_pretraining.contact_model import ContactModel, ContactModelConfig
from dapl_baselines.policy.config import PolicyNetworkConfig
from dapl_baselines.policy.network import PolicyNetwork
from dapl_baselines.policy.policy import NetworkPolicy
from dapl_baselines.push_policy.critic import PushCritic, PushCriticConfig
from dapl_baselines.push_policy.student import PushStudent, PushStudentConfig
from dapl_baselines.push_policy.student_policy import PushStudentPolicy
from dapl_baselines.push_policy.teacher_policy import PushTeacherPolicy
from dapl_baselines.tensor_file import read_tensor_file, write_tensor_file
from dapl_baselines.world_model.model import WorldModel, WorldModelConfig

FORMAT: Literal["clutter6d-checkpoint"] = "clutter6d-checkpoint"
Precision = Literal["float32", "float16"]


class TrainingRecord(FileModel):
    """One stretch of training.

    Attributes:
        method: For instance ``"ppo"`` or ``"distillation"``.
        steps: Environment steps or optimiser steps, as ``unit`` says.
        unit: What ``steps`` counts.
        seed: Seed of the training.
        split_sha256: Hash of the scenes it was trained on; empty if none.
        code_sha256: Hash of the code that trained it; empty if unknown.
        settings: The training's configuration, as plain values.
    """

    schema_version: Literal[1] = 1
    method: str
    steps: int = Field(ge=0)
    unit: str
    seed: int
    split_sha256: str = ""
    code_sha256: str = ""
    settings: dict[str, JsonValue] = Field(default_factory=dict)


class CheckpointHeader(FileModel):
    """Everything in a checkpoint but its tensors.

    Attributes:
        format: Marks the file as ours.
        architecture: Name in ``ARCHITECTURES``.
        config: The architecture's configuration.
        history: How the weights came about, first to last.
        weights_sha256: Hash of the tensors as they are stored.
        precision: Of the trained weights; buffers, such as running statistics, keep their own.
        clutter6d: Version that wrote the file.
    """

    schema_version: Literal[1] = 1
    format: Literal["clutter6d-checkpoint"]
    architecture: str
    config: dict[str, JsonValue]
    history: tuple[TrainingRecord, ...] = ()
    weights_sha256: str = Field(pattern="^[0-9a-f]{64}$")
    precision: Precision = "float32"
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
        to_policy: Module and policy hash to policy; ``None``: it is part of one at most.
    """

    config: type[FileModel]
    build: Callable[[Any], nn.Module]
    to_policy: Callable[[Any, str], Policy] | None = None


ARCHITECTURES: Mapping[str, Architecture] = {
    "contact-model": Architecture(config=ContactModelConfig, build=ContactModel),
    "policy-network": Architecture(config=PolicyNetworkConfig, build=PolicyNetwork, to_policy=NetworkPolicy),
    "push-critic": Architecture(config=PushCriticConfig, build=PushCritic, to_policy=PushTeacherPolicy),
    "push-student": Architecture(config=PushStudentConfig, build=PushStudent, to_policy=PushStudentPolicy),
    "world-model": Architecture(config=WorldModelConfig, build=WorldModel),
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
        InvalidFileError: It is not an acceptable checkpoint, or not of a policy.
        UnknownNameError: Its architecture is not known.
    """
    checkpoint = read_checkpoint(path)
    to_policy = ARCHITECTURES[checkpoint.header.architecture].to_policy
    if to_policy is None:
        raise InvalidFileError(path, f"holds a {checkpoint.header.architecture}, which is no policy")
    return to_policy(checkpoint.module, checkpoint.header.policy_hash())


def write_checkpoint(
    path: Path,
    *,
    architecture: str,
    config: FileModel,
    module: nn.Module,
    history: tuple[TrainingRecord, ...] = (),
    precision: Precision = "float32",
) -> CheckpointHeader:
    """Write a checkpoint, atomically.

    Args:
        path: The file.
        architecture: Name in ``ARCHITECTURES``.
        config: The architecture's configuration.
        module: What is stored.
        history: How its weights came about, first to last.
        precision: Of the trained weights in the file; what is read back are exactly the rounded values.

    Raises:
        UnknownNameError: The architecture is not in the registry.
        InvalidValueError: A weight is not finite, or too large for the precision.
        StorageError: The file cannot be written.
    """
    _find_architecture(architecture)
    weights = {name: tensor.detach().cpu().contiguous() for name, tensor in _stored(module, precision).items()}
    too_large = [name for name, tensor in weights.items() if tensor.is_floating_point() and not _is_finite(tensor)]
    if too_large:
        raise InvalidValueError(f"tensor '{too_large[0]}' holds values that are not finite in {precision}")
    header = CheckpointHeader(
        format=FORMAT,
        architecture=architecture,
        config=config.model_dump(mode="json"),
        history=history,
        weights_sha256=weights_sha256(weights),
        precision=precision,
        clutter6d=__version__,
    )
    write_tensor_file(path, {**header.model_dump(mode="json"), "state_dict": weights})
    return header


def read_checkpoint(path: Path) -> Checkpoint:
    """Read and check a checkpoint; nothing in it is executed.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is too large, no checkpoint of ours, or does not fit its architecture.
        UnknownNameError: Its architecture is not known.
    """
    content = read_tensor_file(path)
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
        expected = _stored(architecture.build(config), header.precision)
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


def _stored(module: nn.Module, precision: Precision) -> dict[str, Tensor]:
    """The tensors of a module, its trained weights in the precision in which they are stored."""
    tensors, dtype = dict(module.state_dict()), getattr(torch, precision)
    for name, _ in module.named_parameters():
        tensors[name] = tensors[name].to(dtype)
    return tensors


def _is_finite(tensor: Tensor) -> bool:
    return bool(torch.isfinite(tensor).all())


def _check_weights(path: Path, weights: object, expected: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The stored weights, if they have exactly the names, shapes and types of the architecture and are finite."""
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
        if tensor.is_floating_point() and not _is_finite(tensor):
            raise InvalidFileError(path, f"not a valid checkpoint: tensor '{name}' holds values that are not finite")
        checked[name] = tensor
    return checked
