"""How a command makes and follows a training of a policy."""

from collections.abc import Callable, Generator
from contextlib import closing
from pathlib import Path
from typing import Protocol, TypeVar, runtime_checkable

from rich.console import Console

from clutter6d.progress import BarsByName, progress_bars
from dapl_baselines.training_report import Standing, TrainingReport, until
from dapl_baselines.validation_run import Observer

Report = TypeVar("Report", bound=TrainingReport)
ReportMade = TypeVar("ReportMade", bound=TrainingReport, covariant=True)


@runtime_checkable
class Training(Protocol[ReportMade]):
    """A training that can be followed."""

    @property
    def standing(self) -> Standing:
        """How far it is."""
        ...

    def run(self) -> Generator[ReportMade, None, None]:
        """Make the iterations that are left."""
        ...


def follow(
    make: Callable[[Observer], Training[Report]],
    describe: Callable[[Report], str],
    *,
    name: str,
    iterations: int,
    out: Path,
    max_minutes: float | None,
) -> None:
    """Make a training and run it, with a bar, a line for each look, and one at the end.

    Args:
        make: Makes or continues it; given whom to tell of what takes long.
        describe: An iteration in a few words, for the bar.
        name: The bar's at first.
        iterations: Iterations in all.
        out: Its folder.
        max_minutes: Minutes after which it is left; ``None``: it is followed to the end.
    """
    console = Console(markup=False, emoji=False)
    with progress_bars(console) as progress:
        bar = progress.add_task(name, total=iterations, completed=0)
        training = make(BarsByName(progress).update)
        progress.update(bar, completed=training.standing.iteration)
        with closing(training.run()) as reports:
            for report in until(reports, max_minutes):
                progress.update(bar, completed=report.iteration, description=describe(report))
                if report.validation is not None:
                    progress.console.print(report.describe_look(), highlight=False)
    made = training.standing.iteration
    console.print(f"{made} of {iterations} iterations are made; written to {out}", highlight=False)
