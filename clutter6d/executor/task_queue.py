"""The items of one call: which wait, and how often each was lost with its worker."""

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic

from clutter6d.executor.tasks import Item, TaskFailure, TaskResult
from clutter6d.executor.wire import Payload, decode

MAX_LOSSES = 3
"""An item whose worker was killed from outside so often is given up as a crash: it may be what gets workers killed."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Outcome:
    """How one item ended in a worker, before anything of it is decoded.

    Attributes:
        payload: Value and failure as the child sent them; ``None`` if it died over the item.
        failure: How it died.
        stage: The last stage it announced.
        seconds: Wall time from receiving the item.
        is_lost: It was killed from outside, so the item is not to blame.
    """

    payload: Payload | None = None
    failure: TaskFailure | None = None
    stage: str = ""
    seconds: float = 0.0
    is_lost: bool = False


class TaskQueue(Generic[Item]):
    """The items that wait, in order; one that was lost with its worker comes next again.

    Args:
        items: All items.
    """

    def __init__(self, items: Sequence[Item]) -> None:
        self._items = items
        self._waiting = deque(range(len(items)))
        self._losses: Counter[int] = Counter()

    def __bool__(self) -> bool:
        """Whether any item waits."""
        return bool(self._waiting)

    def take(self) -> tuple[int, Item]:
        """The next item and its index."""
        index = self._waiting.popleft()
        return index, self._items[index]

    def settle(self, index: int, outcome: Outcome) -> TaskResult[Item, object] | None:
        """The item's result; or ``None`` if the item was lost and waits again."""
        if outcome.is_lost:
            self._losses[index] += 1
            if self._losses[index] < MAX_LOSSES:
                self._waiting.appendleft(index)
                return None
        value, failure = (None, outcome.failure) if outcome.payload is None else decode(outcome.payload)
        return TaskResult(
            index=index,
            item=self._items[index],
            value=value,
            failure=failure and failure.in_stage(outcome.stage),
            seconds=outcome.seconds,
        )
