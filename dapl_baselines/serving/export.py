"""From a checkpoint to files that run without our code: ONNX and TorchScript, each compared with the checkpoint."""

import hashlib
import io
import logging
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
import torch
from jaxtyping import Float32
from torch import Tensor

from clutter6d import __version__
from clutter6d.errors import Clutter6DError
from clutter6d.schema import write_bytes, write_model
from clutter6d.seeding import generator
from dapl_baselines.serving.manifest import (
    ACTIONS,
    FILES,
    MANIFEST_FILE,
    NEXT_MEMORY_NAME,
    ExportedFile,
    ExportManifest,
    Format,
    TensorSpec,
    input_specs,
)
from dapl_baselines.serving.observation_module import ObservationModule, read_observation_module
from dapl_baselines.serving.onnx_policy import open_session

TOLERANCE_RAD: Final = 1e-4
"""Largest difference of an action that an export may have: a thousandth of the action scale. Runtimes sum in another
order, so the last bits differ."""
TRIALS: Final = 20
"""Observations that follow one another: more than a policy can remember."""

Rows = Sequence[Float32[np.ndarray, "1 ..."]]
Runner = Callable[[Rows], Rows]
"""From an observation's entries and the memory, if there is one, to the actions and the next memory."""


class ExportError(Clutter6DError):
    """An exported policy does not do what the checkpoint does."""


def export_policy(checkpoint: Path, out: Path, formats: Sequence[Format]) -> Iterator[ExportedFile]:
    """Export a policy to a folder; yields each file when it is written, and ends by writing ``policy.json``.

    Args:
        checkpoint: A ``.pt`` file.
        out: The folder.
        formats: What to write.

    Raises:
        InvalidFileError: The checkpoint is not acceptable, or holds no policy that a robot could run.
        ExportError: An exported file gives other actions than the checkpoint.
    """
    module, policy_hash = read_observation_module(checkpoint)
    inputs = input_specs(module.fields)
    specs = inputs if module.memory is None else (*inputs, module.memory)
    trials = [trial_observation(inputs, seed) for seed in range(TRIALS)]
    files: list[ExportedFile] = []
    for kind in formats:
        content = EXPORTERS[kind](module, specs, policy_hash)
        parity = _compare(kind, module, content, trials)
        write_bytes(out / FILES[kind], content)
        files.append(ExportedFile(format=kind, sha256=hashlib.sha256(content).hexdigest(), parity_rad=parity))
        yield files[-1]
    manifest = ExportManifest(
        policy=module.name,
        policy_hash=policy_hash,
        inputs=inputs,
        memory=module.memory,
        action_scale_rad=module.action_scale_rad,
        files=tuple(files),
        clutter6d=__version__,
    )
    write_model(out / MANIFEST_FILE, manifest)


def to_onnx(module: ObservationModule, specs: Sequence[TensorSpec], policy_hash: str) -> bytes:
    """The module as an ONNX file, with the weights in it; its metadata has the policy's hash."""
    with _quiet_exporters():
        program: Any = torch.onnx.export(
            module,
            _example(specs),
            dynamo=True,
            verbose=False,
            input_names=[spec.name for spec in specs],
            output_names=[ACTIONS.name, *([] if module.memory is None else [NEXT_MEMORY_NAME])],
        )
    program.model.metadata_props.update(policy_hash=policy_hash, clutter6d=__version__)
    return cast(bytes, program.model_proto.SerializeToString())


def to_torchscript(module: ObservationModule, specs: Sequence[TensorSpec], policy_hash: str) -> bytes:
    """The module as a TorchScript file, which C++ loads without Python."""
    buffer = io.BytesIO()
    with _quiet_exporters():
        traced: Any = torch.jit.trace(module, _example(specs))
        torch.jit.save(traced, buffer, _extra_files={"policy_hash": policy_hash})
    return buffer.getvalue()


def run_torchscript(content: bytes) -> Runner:
    """A TorchScript file as a function of an observation's entries."""
    with _quiet_exporters():
        module: Any = torch.jit.load(io.BytesIO(content))
    return lambda rows: _run(module, rows)


def run_onnx(content: bytes) -> Runner:
    """An ONNX file as a function of an observation's entries."""
    session = open_session(content)
    names = [item.name for item in session.get_inputs()]
    return lambda rows: session.run(None, dict(zip(names, rows, strict=True)))


EXPORTERS: Final = {"onnx": to_onnx, "torchscript": to_torchscript}
RUNNERS: Final[dict[Format, Callable[[bytes], Runner]]] = {"onnx": run_onnx, "torchscript": run_torchscript}


def trial_observation(specs: Sequence[TensorSpec], seed: int) -> Rows:
    """Numbers of an observation's size, drawn by seed; for points, positions about the table's middle."""
    rng = generator(seed, "export trial")
    return [rng.normal(scale=0.2, size=spec.shape).astype(np.float32) for spec in specs]


def play(run: Runner, trials: Sequence[Rows], memory: TensorSpec | None) -> Float32[np.ndarray, "trial 7"]:
    """The actions on observations that follow one another in an episode.

    Args:
        run: The policy.
        trials: Entries of the observations.
        memory: What it remembers; ``None``: nothing.
    """
    actions: list[np.ndarray] = []
    remembered = [] if memory is None else [np.zeros(memory.shape, dtype=np.float32)]
    for rows in trials:
        action, *remembered = run([*rows, *remembered])
        actions.append(action)
    return np.concatenate(actions)


def _compare(kind: Format, module: ObservationModule, content: bytes, trials: Sequence[Rows]) -> float:
    """The largest difference of any action [rad].

    Raises:
        ExportError: It is too large.
    """
    found, expected = (play(run, trials, module.memory) for run in (RUNNERS[kind](content), partial(_run, module)))
    largest = float(np.abs(found - expected).max())
    if not largest <= TOLERANCE_RAD:
        raise ExportError(f"the {kind} export gives actions that are {largest:.2g} rad off; it was not written")
    return largest


def _run(module: Any, rows: Rows) -> Rows:
    with torch.inference_mode():
        given: Tensor | tuple[Tensor, ...] = module(*(torch.from_numpy(row.copy()) for row in rows))
    return [part.numpy() for part in ((given,) if isinstance(given, Tensor) else given)]


def _example(specs: Sequence[TensorSpec]) -> tuple[Tensor, ...]:
    return tuple(torch.from_numpy(row) for row in trial_observation(specs, 0))


@contextmanager
def _quiet_exporters() -> Iterator[None]:
    """PyTorch's exporters warn of their own plans, and of packages that no policy needs."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        logging.disable(logging.WARNING)
        try:
            yield
        finally:
            logging.disable(logging.NOTSET)
