"""What a task is given and what becomes of it; the same wherever it runs."""

from dataclasses import dataclass, replace
from typing import Generic, Literal, TypeVar

from clutter6d.errors import Clutter6DError

Item = TypeVar("Item")
Result = TypeVar("Result")
FailureKind = Literal["crash", "timeout", "memory", "error"]


@dataclass(frozen=True, kw_only=True, slots=True)
class TaskFailure:
    """Why an item gave no result.

    Attributes:
        kind: ``crash`` (the process died), ``timeout``, ``memory``, or ``error`` (an exception, see ``error``).
        stage: The last stage that the function announced.
        detail: One line.
        error: The exception, if it is one of this package.
    """

    kind: FailureKind
    stage: str
    detail: str
    error: Clutter6DError | None = None

    def in_stage(self, stage: str) -> "TaskFailure":
        """The same failure, with the stage in which it happened unless it is known already."""
        return self if self.stage or not stage else replace(self, stage=stage)


@dataclass(frozen=True, kw_only=True, slots=True)
class TaskResult(Generic[Item, Result]):
    """What became of one item: ``value`` if ``failure`` is ``None``."""

    index: int
    item: Item
    value: Result | None
    failure: TaskFailure | None
    seconds: float


@dataclass(frozen=True, kw_only=True, slots=True)
class TaskLimits:
    """What one item may use before its worker is replaced; ``None`` for no limit.

    Attributes:
        seconds: Processor time, so that a busy machine stops nothing; and a process that only waits is given up
            after ten times as long.
        memory_bytes: Address space.
    """

    seconds: float | None = None
    memory_bytes: int | None = None
