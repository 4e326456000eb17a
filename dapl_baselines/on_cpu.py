"""What is done differently on CPUs, for speed alone."""

from collections.abc import Callable

import torch
from jaxtyping import Float
from torch import Tensor


def is_on_cpu(tensor: Tensor) -> bool:
    """Whether a tensor is computed with on a CPU now, not traced to be computed with elsewhere later."""
    is_traced = torch.compiler.is_compiling() or torch.jit.is_tracing()  # pyright: ignore[reportPrivateImportUsage]
    return tensor.device.type == "cpu" and not is_traced


def in_parts(
    run: Callable[[Tensor], Tensor], rows: Float[Tensor, "row *input"], rows_at_once: int
) -> Float[Tensor, "row *output"]:
    """Apply a function whose rows do not depend on one another; on a CPU to some of them at a time.

    What is computed on the way then fits into the processor's caches. Of a large batch at once it would not, and every
    step would wait for memory, and for the system to hand out pages of it.

    Args:
        run: The function.
        rows: What it is applied to.
        rows_at_once: How many rows fit.
    """
    if not is_on_cpu(rows) or len(rows) <= rows_at_once:
        return run(rows)
    return torch.cat([run(part) for part in rows.split(rows_at_once)])
