"""An exported policy as a folder: ``policy.json`` says what the files beside it are, take and give."""

import hashlib
from pathlib import Path
from typing import Final, Literal

from pydantic import Field

from clutter6d.envs.action import ACTION_SIZE
from clutter6d.envs.observation import OBSERVATION_SHAPES
from clutter6d.errors import InvalidFileError, MissingFileError
from clutter6d.physics import CONTROL_STEP_S
from clutter6d.schema import FileModel, read_bytes, read_model

MANIFEST_FILE: Final = "policy.json"
ONNX_FILE: Final = "policy.onnx"
TORCHSCRIPT_FILE: Final = "policy.torchscript"
ROWS: Final = 1
"""Rows of every call: a robot is one. A fixed number gives the same bits each time."""
MAX_MODEL_BYTES: Final = 1 << 30
MAX_MEMORY: Final = (ROWS, 15, 4097)
"""Largest shape of what a policy remembers: frames before the present one, numbers in each."""

Format = Literal["onnx", "torchscript"]
FILES: Final[dict[Format, str]] = {"onnx": ONNX_FILE, "torchscript": TORCHSCRIPT_FILE}
Sha256 = Field(pattern="^[0-9a-f]{64}$")


class TensorSpec(FileModel):
    """A tensor that goes in or comes out.

    Attributes:
        name: As in the observation; ``actions`` comes out.
        dtype: Of its elements.
        shape: With the rows.
    """

    schema_version: Literal[1] = 1
    name: str
    dtype: Literal["float32"] = "float32"
    shape: tuple[int, ...]


ACTIONS: Final = TensorSpec(name="actions", shape=(ROWS, ACTION_SIZE))
MEMORY_NAME: Final = "memory"
NEXT_MEMORY_NAME: Final = "next_memory"
"""What a policy with a memory takes after the observation, and gives after the actions."""


class ExportedFile(FileModel):
    """One file of the policy.

    Attributes:
        format: Its kind, which is also its name.
        sha256: Hash of its content.
        parity_rad: Largest difference from the actions of the checkpoint that was found when it was exported [rad].
    """

    schema_version: Literal[1] = 1
    format: Format
    sha256: str = Sha256
    parity_rad: float = Field(ge=0)


class ExportManifest(FileModel):
    """``policy.json``.

    Attributes:
        format: Marks the file as ours.
        policy: Its name in tables.
        policy_hash: Of the checkpoint: SHA-256 over architecture, configuration and weights.
        inputs: What the policy takes, in this order.
        output: What it gives: joint residuals [rad].
        memory: What it takes beside its inputs if it remembers something: zeros when an episode begins, then the
            ``next_memory`` that it gave the last time.
        action_scale_rad: No residual is larger [rad].
        control_step_s: How often it wants to be asked [s].
        files: The policy in one or more formats.
        clutter6d: Version that wrote it.
    """

    schema_version: Literal[1] = 1
    format: Literal["clutter6d-export"] = "clutter6d-export"
    policy: str
    policy_hash: str = Sha256
    inputs: tuple[TensorSpec, ...] = Field(min_length=1)
    output: TensorSpec = ACTIONS
    memory: TensorSpec | None = None
    action_scale_rad: float = Field(gt=0)
    control_step_s: float = Field(default=CONTROL_STEP_S, gt=0)
    files: tuple[ExportedFile, ...] = Field(min_length=1)
    clutter6d: str

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the entries of the observation that it takes."""
        return tuple(spec.name for spec in self.inputs)


def memory_spec(past: int, frame_size: int) -> TensorSpec | None:
    """The memory of a policy that knows ``past`` frames before the present one; ``None`` if it knows none."""
    return TensorSpec(name=MEMORY_NAME, shape=(ROWS, past, frame_size)) if past else None


def input_specs(fields: tuple[str, ...]) -> tuple[TensorSpec, ...]:
    """Entries of the observation as inputs."""
    return tuple(TensorSpec(name=name, shape=(ROWS, *OBSERVATION_SHAPES[name])) for name in fields)


def read_manifest(folder: Path) -> ExportManifest:
    """The manifest of an exported policy.

    Raises:
        MissingFileError: There is none.
        InvalidFileError: It is not valid, or names inputs that no observation has.
    """
    path = folder / MANIFEST_FILE
    if not path.is_file():
        raise MissingFileError("exported policy", path, "make one with: dapl export CHECKPOINT")
    manifest = read_model(path, ExportManifest, what="exported policy")
    unknown = [name for name in manifest.fields if name not in OBSERVATION_SHAPES]
    is_known = not unknown and manifest.inputs == input_specs(manifest.fields) and manifest.output == ACTIONS
    if not is_known or not _is_memory(manifest.memory):
        raise InvalidFileError(path, "its inputs or output are not those of a policy of this version; export it anew")
    return manifest


def read_exported(folder: Path, manifest: ExportManifest, kind: Format) -> bytes:
    """The policy in one format.

    Raises:
        MissingFileError: It was not exported in that format, or the file is gone.
        InvalidFileError: It is not the file that was exported.
    """
    hashes = {file.format: file.sha256 for file in manifest.files}
    path = folder / FILES[kind]
    if kind not in hashes:
        raise MissingFileError("exported policy", path, f"export it with --format {kind}")
    content = read_bytes(path, what="exported policy", max_bytes=MAX_MODEL_BYTES)
    if hashlib.sha256(content).hexdigest() != hashes[kind]:
        raise InvalidFileError(path, f"is not the file that {MANIFEST_FILE} was written for; export it anew")
    return content


def _is_memory(spec: TensorSpec | None) -> bool:
    """Whether a policy of this version could remember this."""
    if spec is None:
        return True
    fits = len(spec.shape) == 3 and all(0 < size <= most for size, most in zip(spec.shape, MAX_MEMORY, strict=True))
    return fits and spec.name == MEMORY_NAME
