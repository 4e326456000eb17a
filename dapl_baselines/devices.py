"""Devices that networks run on, by name."""

import torch

from clutter6d.errors import InvalidValueError


def find_device(name: str) -> torch.device:
    """The device of a name; the graphics card, if there is one, for none.

    Raises:
        InvalidValueError: There is no such device here.
    """
    try:
        device = torch.device(name or ("cuda" if torch.cuda.is_available() else "cpu"))
    except RuntimeError:
        raise InvalidValueError(f"device '{name}' is unknown; choose cpu or cuda") from None
    if device.type not in ("cpu", "cuda") or (device.type == "cuda" and not torch.cuda.is_available()):
        raise InvalidValueError(f"there is no device '{name}' here; choose cpu")
    return device
