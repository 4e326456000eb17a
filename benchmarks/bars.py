"""Progress bars of the measurements, on standard error, so that tables can be redirected."""

from collections.abc import Iterator, Sequence
from typing import TypeVar

from rich.console import Console

from clutter6d.progress import progress_bars

Item = TypeVar("Item")


def bar(items: Sequence[Item], label: str) -> Iterator[Item]:
    """Go through items with a progress bar."""
    with progress_bars(Console(stderr=True)) as progress:
        yield from progress.track(items, description=label)
