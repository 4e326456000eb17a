"""What was seen before, from a replay: a row's window is the last rows of its environment in its episode."""

from typing import Final

import numpy as np
import torch
from jaxtyping import Int
from torch import Tensor

from dapl_baselines.replay import Replay

AGE_FIELD: Final = "age"
SEEN_FIELDS: Final = ("state", "stored")
"""What of a row is seen; all else is the teacher's."""


def take_windows(replay: Replay, numbers: Int[np.ndarray, "row"], *, envs: int, history: int) -> dict[str, Tensor]:
    """Some rows of a replay, each with those before it.

    Every step of the environments adds a row of each, in the same order, so that what one saw a step before is ``envs``
    rows earlier, as long as its episode is that old. Rows before the oldest that is drawn have to be kept for it.

    Args:
        replay: It has a field ``age``: steps since the episode began.
        numbers: Of the rows.
        envs: Environments.
        history: Frames of a window, the row's own among them.

    Returns:
        The fields of the rows; of ``state`` and ``stored``, windows ``[row, history, ...]``, oldest first, beside
        ``is_seen``, which of these frames there are. What stands in place of others is to be ignored.
    """
    rows = replay.take(numbers, [name for name in replay.fields if name not in SEEN_FIELDS])
    ages, lags = rows[AGE_FIELD].numpy()[:, None], np.arange(history - 1, -1, -1)
    windows = replay.take(numbers[:, None] - envs * np.minimum(lags, ages), SEEN_FIELDS)
    return rows | windows | {"is_seen": torch.from_numpy(lags <= ages)}
