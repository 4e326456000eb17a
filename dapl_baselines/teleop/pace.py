"""Keeping control steps to the clock on the wall."""

import time
from collections.abc import Callable

from clutter6d.physics import CONTROL_STEP_S


class Pace:
    """One control step every 0.1 s; time that was lost is not caught up.

    Args:
        clock: Seconds that only grow.
        sleep: Waits for some seconds.
    """

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self._clock, self._sleep = clock, sleep
        self._next = clock()

    def wait(self) -> None:
        """Wait until the next control step is due."""
        left = self._next - self._clock()
        if left > 0:
            self._sleep(left)
        self._next = max(self._next, self._clock()) + CONTROL_STEP_S
