"""An exported policy, run by ONNX Runtime; a robot's computer needs no PyTorch."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32

from clutter6d.errors import InvalidFileError, MissingDependencyError
from clutter6d.eval.policy import blaming
from dapl_baselines.serving.manifest import ACTIONS, NEXT_MEMORY_NAME, ONNX_FILE, read_exported, read_manifest

try:
    import onnxruntime
except ModuleNotFoundError:
    raise MissingDependencyError("exported policies need ONNX Runtime: pip install 'clutter6d[serve]'") from None


class OnnxPolicy:
    """An exported policy; if it has a memory, it is kept for each slot.

    Args:
        folder: What ``dapl export`` wrote.

    Attributes:
        manifest: What it is, takes and gives.

    Raises:
        MissingFileError: There is no exported policy.
        InvalidFileError: It is not valid, or not the file that was exported.
    """

    def __init__(self, folder: Path) -> None:
        self.manifest = read_manifest(folder)
        content = read_exported(folder, self.manifest, "onnx")
        try:
            self._session = open_session(content)
        except Exception as error:  # noqa: BLE001  the runtime's errors have no common base
            raise InvalidFileError(folder / ONNX_FILE, f"cannot be run: {' '.join(str(error).split())[:200]}") from None
        self._memories: dict[int, Float32[np.ndarray, "1 past frame"]] = {}

    @property
    def name(self) -> str:
        """Of the checkpoint that was exported."""
        return self.manifest.policy

    @property
    def policy_hash(self) -> str:
        """Of the checkpoint that was exported."""
        return self.manifest.policy_hash

    @property
    def fields(self) -> tuple[str, ...]:
        """The entries of the observation that it takes."""
        return self.manifest.fields

    @property
    def action_scale_rad(self) -> float:
        """No residual is larger [rad]."""
        return self.manifest.action_scale_rad

    def begin(self, slot: int) -> None:
        """An episode starts in a slot: forget the one before."""
        self._memories.pop(slot, None)

    def act(self, slot: int, observation: Mapping[str, Float32[np.ndarray, "..."]]) -> Float32[np.ndarray, "7"]:
        """Joint residuals [rad].

        Raises:
            InvalidValueError: The runtime failed.
        """
        rows, outputs = {name: observation[name][None] for name in self.fields}, [ACTIONS.name]
        if (memory := self.manifest.memory) is not None:
            rows[memory.name] = self._memories.get(slot, np.zeros(memory.shape, dtype=np.float32))
            outputs.append(NEXT_MEMORY_NAME)
        with blaming(f"policy '{self.name}'"):
            actions, *remembered = self._session.run(outputs, rows)
        if remembered:
            self._memories[slot] = remembered[0]
        return actions[0]


def open_session(content: bytes) -> Any:
    """ONNX Runtime on one thread of the processor: the same bits each time, and for one row no slower."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
