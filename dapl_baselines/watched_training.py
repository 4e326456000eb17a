"""Trainings in folders that are continued where they were stopped and watched on the validation scenes.

What is common to them: the loop, the curves, the state on disk, and the looks. A state is written every so many
iterations, so that a kill costs these at most and changes nothing.
"""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final, Generic, Protocol, TypeVar, runtime_checkable

import torch

from clutter6d.assets.asset import Asset
from dapl_baselines.curves import Curves
from dapl_baselines.look import POLICY_FILE, look_at
from dapl_baselines.tensor_file import write_tensor_file
from dapl_baselines.training_report import Standing, TrainingReport
from dapl_baselines.validation import SceneSubset, TrainingScenes
from dapl_baselines.validation_run import Observer, ValidationResult

STATE_FILE: Final = "state.pt"


@runtime_checkable
class Pace(Protocol):
    """What of a training's settings the loop needs."""

    @property
    def iterations(self) -> int:
        """Iterations in all."""
        ...

    @property
    def save_every(self) -> int:
        """Iterations between two states on disk."""
        ...

    @property
    def evaluate_every(self) -> int:
        """Iterations between looks at the validation scenes."""
        ...

    @property
    def max_steps(self) -> int:
        """Control steps of an episode at most."""
        ...


Report = TypeVar("Report", bound=TrainingReport)
Practised = TypeVar("Practised")
Learned = TypeVar("Learned")


class WatchedTraining(ABC, Generic[Report]):
    """A training in a folder, new or continued; what it does in an iteration is a subclass's.

    Args:
        scenes: What is trained and watched on.
        pace: How long it goes on, and how often it is saved and looked at.
        out: The folder, which is already this training's.
        threads: Threads of the simulation; 0 for all cores.
        observe: Told of the episodes of a look, as they end.

    Attributes:
        standing: How far it is.
    """

    def __init__(self, scenes: TrainingScenes, pace: Pace, out: Path, *, threads: int, observe: Observer) -> None:
        self._scenes, self._pace, self._out = scenes, pace, out
        self._threads, self._observe = threads, observe
        self.standing = Standing()

    def run(self) -> Generator[Report, None, None]:
        """Make the iterations that are left; each is yielded when it is made."""
        with closing(Curves(self._out, self.standing.iteration)) as curves, _one_thread():
            while self.standing.iteration < self._pace.iterations:
                report = self._iterate()
                curves.add("training", report.iteration, self._curve_row(report))
                if report.validation is not None:
                    curves.add("validation", report.iteration, report.validation_row())
                if report.iteration % self._pace.save_every == 0 or report.validation is not None:
                    write_tensor_file(self._out / STATE_FILE, self._state())
                yield report

    @abstractmethod
    def _make_iteration(self, iteration: int) -> Callable[[ValidationResult | None], Report]:
        """Make an iteration; returns what makes its report of the look that may follow it.

        Args:
            iteration: Iterations made before, which names what is drawn at random.
        """

    @abstractmethod
    def _curve_row(self, report: Report) -> dict[str, float]:
        """The report's row in ``training.csv``."""

    @abstractmethod
    def _state(self) -> dict[str, object]:
        """A copy of all that decides how the training goes on."""

    @abstractmethod
    def _write_policy(self, path: Path) -> None:
        """Write the policy as a checkpoint."""

    def _iterate(self) -> Report:
        start, before = time.monotonic(), self.standing.iteration
        to_report = self._make_iteration(before)
        number, seconds = before + 1, self.standing.seconds + time.monotonic() - start
        self.standing = replace(self.standing, iteration=number, seconds=seconds)
        is_time = number % self._pace.evaluate_every == 0 or number == self._pace.iterations
        return to_report(self._look() if is_time else None)

    def _look(self) -> ValidationResult:
        """Write the policy, and see how it does as it was written."""
        self._write_policy(self._out / POLICY_FILE)
        result, self.standing = look_at(
            self._out,
            self._scenes.validation,
            self.standing,
            max_steps=self._pace.max_steps,
            threads=self._threads,
            observe=self._observe,
        )
        return result


def side_by_side(practise: Callable[[], Practised], learn: Callable[[], Learned]) -> tuple[Practised, Learned]:
    """Do both at once, the first in a thread of its own."""
    with ThreadPoolExecutor(1) as pool:
        practised = pool.submit(practise)
        learned = learn()
        return practised.result(), learned


def read_targets(scenes: SceneSubset, observe: Observer) -> Iterator[Asset]:
    """The targets of scenes.

    Args:
        scenes: The scenes.
        observe: Told how many are read.
    """
    for done, scene in enumerate(scenes.scenes, 1):
        yield scenes.assets_of(scene)[scene.objects[0].asset_hash]
        observe("reading targets", done, len(scenes.scenes))


@contextmanager
def _one_thread() -> Iterator[None]:
    """One thread for the network: small products gain nothing from more, and practice needs the others."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
