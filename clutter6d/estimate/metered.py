"""Measuring what a task costs, in the worker that does it."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True, slots=True)
class Reading:
    """A value and the processor time it took.

    Attributes:
        value: What the function gave.
        seconds: Processor time of the call [s].
        before_s: Processor time of this process before the call [s]; of a new one, what starting it took.
    """

    value: Any
    seconds: float
    before_s: float


@dataclass(frozen=True, slots=True)
class Metered:
    """A function that says what each call took; picklable if the function is."""

    function: Callable[[Any], Any]

    def __call__(self, item: Any) -> Reading:
        """Call the function."""
        start = time.process_time()
        value = self.function(item)
        return Reading(value=value, seconds=time.process_time() - start, before_s=start)
