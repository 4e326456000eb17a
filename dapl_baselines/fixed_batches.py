"""Running a module so that a row's result does not depend on the rows beside it, to the bit."""

from collections.abc import Callable
from typing import Final

import numpy as np
import torch
from jaxtyping import Float32
from torch import Tensor

BATCH_ROWS: Final = 32
"""Rows of every forward pass, padded with zeros: a matrix product's last bits depend on the shape of the batch."""


def forward_in_fixed_batches(
    module: Callable[..., Tensor], *inputs: Float32[Tensor, "row ..."]
) -> Float32[np.ndarray, "row out"]:
    """Run a module on batches of exactly ``BATCH_ROWS`` rows on one thread; a row's result is the same anywhere.

    Args:
        module: A module or a method of one; takes as many tensors as there are inputs, and gives one.
        inputs: All with as many rows.
    """
    count, threads = len(inputs[0]), torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with torch.inference_mode():
            batches = zip(*(_pad(rows).split(BATCH_ROWS) for rows in inputs), strict=True)
            return np.concatenate([module(*batch).numpy() for batch in batches])[:count]
    finally:
        torch.set_num_threads(threads)


def _pad(rows: Float32[Tensor, "row ..."]) -> Float32[Tensor, "padded ..."]:
    missing = -len(rows) % BATCH_ROWS
    return torch.cat([rows, rows.new_zeros(missing, *rows.shape[1:])]) if missing else rows
