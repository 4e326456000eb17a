"""What is done differently on CPUs, for speed alone."""

from collections.abc import Callable
from functools import cache

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

    What is computed on the way then fits into the processor's caches; of a large batch at once it would not.

    Args:
        run: The function.
        rows: What it is applied to.
        rows_at_once: How many rows fit.
    """
    if not is_on_cpu(rows):
        return run(rows)
    keep_freed_memory()
    if len(rows) <= rows_at_once:
        return run(rows)
    return torch.cat([run(part) for part in rows.split(rows_at_once)])


@cache
def keep_freed_memory() -> None:
    """Have the C library keep the memory of freed tensors for the next ones, up to 62 MB.

    By default the GNU library soon gives it back to the system, which clears every page before handing it out again.
    In a transformer of small tokens that takes half as long as all matrix products. The library keeps twice the size of
    the largest block that was ever freed, of those up to 32 MB: one is enough, and it is never written to. With another
    library nothing changes.
    """
    torch.empty(31 << 20, dtype=torch.uint8)
