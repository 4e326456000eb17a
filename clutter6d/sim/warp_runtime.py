"""Where torch, Warp and MuJoCo Warp come into the toolkit: only the modules of the GPU back end import this one.

The command-line program and the reference evaluation never load it. Warp compiles its kernels at first use and keeps
them in a cache (``WARP_CACHE_PATH``, default: the user's cache folder).
"""

import logging
from collections.abc import Generator
from contextlib import contextmanager

from clutter6d.errors import InvalidValueError, MissingDependencyError

try:
    import torch
    import warp
except ImportError as error:
    raise MissingDependencyError(
        f"the GPU back end needs {error.name}, which is not installed; run: pip install 'clutter6d[gpu]'"
    ) from None

warp.config.log_level = max(warp.config.log_level, logging.WARNING)

try:
    import mujoco_warp
except ImportError as error:
    raise MissingDependencyError(
        f"the GPU back end needs {error.name}, which is not installed; run: pip install 'clutter6d[gpu]'"
    ) from None

__all__ = ["mujoco_warp", "on_device", "open_device", "torch", "warp"]


def open_device(name: str) -> torch.device:
    """The device of a name: ``"cuda"``, ``"cuda:1"``, or ``"cpu"``, on which Warp runs for tests only.

    Raises:
        InvalidValueError: There is no such device.
    """
    try:
        device = torch.device(name)
    except (RuntimeError, ValueError):
        raise InvalidValueError(f"device '{name}' is unknown; give 'cuda', 'cuda:0' ... or 'cpu'") from None
    if device.type not in ("cpu", "cuda"):
        raise InvalidValueError(f"device '{name}' is not supported by Warp; give 'cuda', 'cuda:0' ... or 'cpu'")
    if device.type == "cpu":
        warp.init()
        return torch.device("cpu")
    if not torch.cuda.is_available() or not warp.is_cuda_available():
        raise InvalidValueError(
            f"device '{name}': no CUDA device can be used here; install NVIDIA's driver and a torch build with CUDA, "
            "or leave the device out to simulate on the CPU"
        )
    index = torch.cuda.current_device() if device.index is None else device.index
    if index >= torch.cuda.device_count():
        raise InvalidValueError(f"device '{name}': there are {torch.cuda.device_count()} CUDA devices, from cuda:0 on")
    return torch.device("cuda", index)


@contextmanager
def on_device(device: torch.device) -> Generator[None]:
    """Warp's operations go to this device; its stream waits for torch's default stream and the other way round."""
    with warp.ScopedDevice(warp.device_from_torch(device)):
        yield
