"""A teacher's training in a folder: continued where it was stopped, watched on the validation scenes.

run.json            everything the outcome depends on
state.pt            how far it is: critic, optimiser, every episode's simulation
replay/             what it learns from
training.csv        one row an iteration: losses, and what became of the episodes
validation.csv      one row a look at the validation scenes
policy.pt, best.pt  the teacher at the last look, and at the best
tensorboard/        the same curves

In an iteration the teacher practises with the network of the iteration before, and learns from the transitions that
there were before: both go on side by side, and what comes of it does not depend on which is faster.
"""

import copy
import time
from collections.abc import Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final, Literal

import torch

from clutter6d.assets.asset import Asset
from clutter6d.schema import FileModel
from clutter6d.seeding import generator
from dapl_baselines.checkpoint import TrainingRecord, write_checkpoint
from dapl_baselines.code_hash import code_sha256
from dapl_baselines.curves import Curves
from dapl_baselines.look import POLICY_FILE, look_at
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.replay import Replay
from dapl_baselines.run_folder import claim
from dapl_baselines.teacher.iteration_report import TeacherReport
from dapl_baselines.teacher.learner import Losses, TeacherLearner
from dapl_baselines.teacher.practice import Practice
from dapl_baselines.teacher.settings import TeacherSettings
from dapl_baselines.teacher.training_state import Course, copy_state, read_state
from dapl_baselines.tensor_file import write_tensor_file
from dapl_baselines.training_report import Standing
from dapl_baselines.validation import SceneSubset, TrainingScenes
from dapl_baselines.validation_run import Observer, ValidationResult, ignore

ARCHITECTURE: Final = "push-critic"
RUN_FILE, STATE_FILE, REPLAY_FOLDER = "run.json", "state.pt", "replay"


class TeacherRecord(FileModel):
    """``run.json``: everything that the outcome of a teacher's training depends on.

    Attributes:
        schema_version: Of these fields.
        settings: Network, practice, losses.
        training_sha256: The scenes trained on.
        validation_sha256: The scenes watched on.
    """

    schema_version: Literal[1] = 1
    settings: TeacherSettings
    training_sha256: str
    validation_sha256: str


class TeacherTraining:
    """One training in one folder, new or continued.

    Args:
        scenes: What is trained and watched on; all of as many objects.
        settings: Everything the user chooses; the critic's number of obstacles is that of the scenes.
        out: The folder.
        threads: Threads of the simulation; 0 for all cores.
        observe: Told of the targets that are read, and of the episodes of a look.

    Attributes:
        standing: How far it is.

    Raises:
        InvalidValueError: The folder holds a training with other settings, or something else.
        InvalidFileError: A file in it is damaged.
        StorageError: It cannot be written.
    """

    def __init__(
        self,
        scenes: TrainingScenes,
        settings: TeacherSettings,
        out: Path,
        *,
        threads: int = 0,
        observe: Observer = ignore,
    ) -> None:
        obstacles = len(scenes.training.scenes[0].objects) - 1
        critic = settings.critic.model_copy(update={"obstacles": obstacles})
        self.settings = settings.model_copy(update={"critic": critic})
        self._scenes, self._out, self._threads, self._observe = scenes, out, threads, observe
        record = TeacherRecord(
            settings=self.settings,
            training_sha256=scenes.training.sha256,
            validation_sha256=scenes.validation.sha256,
        )
        claim(out / RUN_FILE, record, what="teacher's training", may_change={"settings.iterations"})
        shapes = TargetShapes.of(_targets(scenes.training, observe))
        learner = TeacherLearner(self.settings, shapes)
        practice = Practice(scenes.training, shapes, self.settings, threads=threads)
        replay = Replay(out / REPLAY_FOLDER, practice.blank_rows(), self.settings.kept)
        self._course, self._acting = Course(learner=learner, practice=practice, replay=replay), learner.critic
        self._state: dict[str, object] | None = None
        self.standing = Standing()
        if (out / STATE_FILE).is_file():
            self.standing = read_state(out / STATE_FILE, self._course)
        self._acting = copy.deepcopy(learner.critic).requires_grad_(False)

    def run(self) -> Generator[TeacherReport, None, None]:
        """Make the iterations that are left; each is yielded when it is made."""
        with closing(Curves(self._out, self.standing.iteration)) as curves, _one_thread():
            while self.standing.iteration < self.settings.iterations:
                report = self._iterate()
                curves.add("training", report.iteration, report.curve_row())
                if report.validation is not None:
                    curves.add("validation", report.iteration, report.validation_row())
                if report.iteration % self.settings.save_every == 0 or report.validation is not None:
                    write_tensor_file(self._out / STATE_FILE, copy_state(self.standing, self._course))
                yield report

    def _iterate(self) -> TeacherReport:
        """Practice and learning side by side, and a look at the validation scenes if it is time for one."""
        start, before = time.monotonic(), self.standing.iteration
        losses = self._practise_and_learn(before)
        number, seconds = before + 1, self.standing.seconds + time.monotonic() - start
        self.standing = replace(self.standing, iteration=number, seconds=seconds)
        is_time = number % self.settings.evaluate_every == 0 or number == self.settings.iterations
        return TeacherReport(
            iteration=number,
            environment_steps=self._environment_steps,
            seconds=seconds,
            episodes=self._course.practice.slots.tally.take(),
            pushes=self._course.replay.count,
            updates=self._course.learner.updates,
            losses=losses,
            validation=self._look() if is_time else None,
        )

    def _practise_and_learn(self, iteration: int) -> Losses | None:
        course, settings = self._course, self.settings
        self._acting.load_state_dict(course.learner.critic.state_dict())
        end, seed = course.replay.count, settings.seed
        with ThreadPoolExecutor(1) as pool:
            practised = pool.submit(
                course.practice.run, self._acting, course.replay, generator(seed, "practice", iteration)
            )
            losses = None
            if end >= settings.warm_up:
                losses = course.learner.learn(course.replay, end, generator(seed, "learning", iteration))
            practised.result()
        return losses

    def _look(self) -> ValidationResult:
        """Write the teacher, and see how it does as it was written."""
        self._write_policy(self._out / POLICY_FILE)
        result = look_at(
            self._out,
            self._scenes.validation,
            best_success=self.standing.best_success,
            max_steps=self.settings.max_steps,
            threads=self._threads,
            observe=self._observe,
        )
        best = max(self.standing.best_success, result.success_rate)
        self.standing = replace(self.standing, best_success=best)
        return result

    def _write_policy(self, path: Path) -> None:
        record = TrainingRecord(
            method="push-critic",
            steps=self._environment_steps,
            unit="environment steps",
            seed=self.settings.seed,
            split_sha256=self._scenes.training.sha256,
            code_sha256=code_sha256(),
            settings=self.settings.model_dump(mode="json"),
        )
        write_checkpoint(
            path,
            architecture=ARCHITECTURE,
            config=self.settings.critic,
            module=self._course.learner.critic,
            history=(record,),
            precision=self.settings.stored_precision,
        )

    @property
    def _environment_steps(self) -> int:
        return self.standing.iteration * self.settings.steps * self.settings.slots


def _targets(scenes: SceneSubset, observe: Observer) -> Iterator[Asset]:
    """The targets of scenes."""
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
