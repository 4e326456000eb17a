"""The last frames of every slot, as a policy remembers them."""

import numpy as np
import torch
from jaxtyping import Float32, Int
from torch import Tensor


class FrameMemory:
    """Frames by slot and by step; a slot knows nothing of the others.

    Args:
        history: Frames that are remembered of each slot, the present one among them.
        size: Numbers in a frame.
    """

    def __init__(self, history: int, size: int) -> None:
        self._history = history
        self._frames = np.zeros((0, history, size), dtype=np.float32)

    def forget(self, slots: Int[np.ndarray, "slot"]) -> None:
        """Episodes start in slots: there are no frames."""
        self._make_room(slots)
        self._frames[slots] = 0

    def remember(
        self, slots: Int[np.ndarray, "slot"], steps: Int[np.ndarray, "slot"], frames: Float32[np.ndarray, "slot frame"]
    ) -> Float32[Tensor, "slot history frame"]:
        """Take the frames of a step; returns the last ones of each slot, oldest first.

        Args:
            slots: Which.
            steps: Control steps each episode has made; told of the same step again, it remembers the later frame.
            frames: What is remembered of it.
        """
        self._make_room(slots)
        self._frames[slots, steps % self._history] = frames
        places = (steps[:, None] + 1 + np.arange(self._history)) % self._history
        return torch.from_numpy(self._frames[slots[:, None], places])

    def _make_room(self, slots: Int[np.ndarray, "slot"]) -> None:
        missing = int(slots.max(initial=-1)) + 1 - len(self._frames)
        if missing > 0:
            self._frames = np.pad(self._frames, ((0, missing), (0, 0), (0, 0)))
