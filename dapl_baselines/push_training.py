"""Trainings of networks that judge pushes, in folders, continued where they were stopped, watched on validation scenes.

What is common to them: the loop, the curves, the state on disk, the looks and the checkpoints. A state is written every
so many iterations, so that a kill costs these at most and changes nothing.
"""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, Final, Generic, TypeVar

import torch

from clutter6d.assets.asset import Asset
from dapl_baselines.checkpoint import TrainingRecord, write_checkpoint
from dapl_baselines.curves import Curves
from dapl_baselines.look import Lookout
from dapl_baselines.push_policy.critic import PushCritic
from dapl_baselines.push_policy.student import PushStudent
from dapl_baselines.push_policy.training_settings import PushTrainingSettings
from dapl_baselines.tensor_file import write_tensor_file
from dapl_baselines.training_history import environment_record
from dapl_baselines.training_report import Standing, TrainingReport
from dapl_baselines.validation import SceneSubset, TrainingScenes
from dapl_baselines.validation_run import Observer, ValidationResult

STATE_FILE: Final = "state.pt"


Report = TypeVar("Report", bound=TrainingReport)
Practised = TypeVar("Practised")
Learned = TypeVar("Learned")


class PushTraining(ABC, Generic[Report]):
    """A training in a folder, new or continued; what it does in an iteration is a subclass's.

    Args:
        scenes: What is trained and watched on.
        settings: Of the training.
        out: The folder.
        threads: Threads of the simulation; 0 for all cores.
        observe: Told of the episodes of a look, as they end.

    Attributes:
        architecture: Of the checkpoints.
        method: How its checkpoints say they were made.
        settings: Of the training.
        standing: How far it is.
    """

    architecture: ClassVar[str]
    method: ClassVar[str]

    def __init__(
        self, scenes: TrainingScenes, settings: PushTrainingSettings, out: Path, *, threads: int, observe: Observer
    ) -> None:
        self._scenes, self.settings, self._out = scenes, settings, out
        self._lookout = Lookout(
            folder=out, scenes=scenes.validation, max_steps=settings.max_steps, threads=threads, observe=observe
        )
        self._history: tuple[TrainingRecord, ...] = ()
        self.standing = Standing()

    def run(self) -> Generator[Report, None, None]:
        """Make the iterations that are left; each is yielded when it is made."""
        with closing(Curves(self._out, self.standing.iteration)) as curves, _one_thread():
            while self.standing.iteration < self.settings.iterations:
                report = self._iterate()
                curves.add("training", report.iteration, report.curve_row())
                if report.validation is not None:
                    curves.add("validation", report.iteration, report.validation_row())
                if report.iteration % self.settings.save_every == 0 or report.validation is not None:
                    write_tensor_file(self._out / STATE_FILE, self._state())
                yield report

    @abstractmethod
    def _make_iteration(self, iteration: int) -> Report:
        """Make an iteration; how long it took and the look that may follow are added to its report.

        Args:
            iteration: Iterations made before, which names what is drawn at random.
        """

    @abstractmethod
    def _state(self) -> dict[str, object]:
        """A copy of all that decides how the training goes on."""

    @abstractmethod
    def _network(self) -> PushCritic | PushStudent:
        """What is trained."""

    def _iterate(self) -> Report:
        start, before = time.monotonic(), self.standing.iteration
        report = self._make_iteration(before)
        number, seconds = before + 1, self.standing.seconds + time.monotonic() - start
        self.standing = replace(self.standing, iteration=number, seconds=seconds)
        is_time = number % self.settings.evaluate_every == 0 or number == self.settings.iterations
        return replace(report, seconds=seconds, validation=self._look() if is_time else None)

    def _environment_steps(self, iterations: int) -> int:
        return iterations * self.settings.steps * self.settings.slots

    def _look(self) -> ValidationResult:
        """Write the policy, and see how it does as it was written."""
        result, self.standing = self._lookout.look(self._write_policy, self.standing)
        return result

    def _write_policy(self, path: Path) -> None:
        """Write the network as a checkpoint."""
        record = environment_record(
            self.method,
            steps=self._environment_steps(self.standing.iteration),
            seed=self.settings.seed,
            scenes=self._scenes,
            settings=self.settings,
        )
        network = self._network()
        write_checkpoint(
            path,
            architecture=self.architecture,
            config=network.config,
            module=network,
            history=(*self._history, record),
            precision=self.settings.stored_precision,
        )


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
