"""What many assets or scenes will take, from what a few took."""

import math
from dataclasses import dataclass

import numpy as np

from clutter6d.errors import InvalidValueError

SECONDS_PER_HOUR = 3600.0
_CONFIDENT = 1.96


@dataclass(frozen=True, kw_only=True, slots=True)
class UnitCost:
    """What one item costs, measured on a sample.

    Attributes:
        seconds: Processor time of each sampled item in a warm worker [s].
        bytes_each: What a finished item takes on disk, mean.
        share: Share of the items tried that give a result; the others cost time and nothing else.
        start_s: Processor time of a worker until it is warm [s].
        serial_s: Time for each result in the one process that collects them [s]; it bounds any number of workers.
    """

    seconds: tuple[float, ...]
    bytes_each: float
    share: float = 1.0
    start_s: float = 0.0
    serial_s: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a sample of nothing."""
        if not self.seconds:
            raise InvalidValueError("a unit cost needs at least one measured item")
        if not 0 < self.share <= 1:
            raise InvalidValueError(f"{self.share:.0%} of the sampled items gave a result; nothing can be planned")

    @property
    def mean_s(self) -> float:
        """The mean, which is what sums are made of: a few slow items weigh as much as they take."""
        return float(np.mean(self.seconds))

    @property
    def median_s(self) -> float:
        """The middle one; less than the mean where a few items take long."""
        return float(np.median(self.seconds))

    @property
    def error_share(self) -> float:
        """Half width of the mean's 95% interval, as a share of it; infinite for a single item."""
        count = len(self.seconds)
        if count < 2:
            return math.inf
        return float(_CONFIDENT * np.std(self.seconds, ddof=1) / math.sqrt(count) / self.mean_s)


@dataclass(frozen=True, kw_only=True, slots=True)
class StagePlan:
    """What one stage will take.

    Attributes:
        items: Results wanted.
        tried: Items that must be tried for them.
        core_hours: Processor time of all workers and of the collecting process [h].
        hours: Time on the wall, with every worker on a core of its own [h].
        bytes: On disk.
        is_collector_bound: Whether more workers would not help, since results cannot be stored faster.
    """

    items: int
    tried: int
    core_hours: float
    hours: float
    bytes: float
    is_collector_bound: bool


def plan_stage(items: int, cost: UnitCost, workers: int) -> StagePlan:
    """Extrapolate from the unit cost to many items on many workers.

    Raises:
        InvalidValueError: There is not at least one worker.
    """
    if workers < 1:
        raise InvalidValueError(f"workers is {workers}; at least 1 is needed")
    tried = math.ceil(items / cost.share)
    work_s, collecting_s = tried * cost.mean_s, items * cost.serial_s
    at_once = max(min(workers, tried), 1)
    spread_s = work_s / at_once
    return StagePlan(
        items=items,
        tried=tried,
        core_hours=(work_s + at_once * cost.start_s + collecting_s) / SECONDS_PER_HOUR,
        hours=(cost.start_s + max(spread_s, collecting_s)) / SECONDS_PER_HOUR,
        bytes=items * cost.bytes_each,
        is_collector_bound=collecting_s > spread_s,
    )
