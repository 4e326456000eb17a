"""A distillation in a folder: continued where it was stopped, watched on the validation scenes.

run.json            everything the outcome depends on
state.pt            how far it is: student, optimiser, every environment's simulation
replay/             what the student learns from
training.csv        one row an iteration: losses, and what became of the episodes
validation.csv      one row a look at the validation scenes
policy.pt, best.pt  the student at the last look, and at the best
tensorboard/        the same curves

A teacher that remembers something of an episode cannot be asked for it: when a training goes on, such a teacher begins
anew in the midst of the episodes that run. With one that remembers nothing, as policy networks, it goes on to the bit.
"""

import time
from collections.abc import Generator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Final, Literal, cast

from torch import nn

from clutter6d.eval.policy import Policy
from clutter6d.schema import FileModel
from dapl_baselines.checkpoint import write_checkpoint
from dapl_baselines.curves import Curves
from dapl_baselines.distillation.dagger import Dagger, make_rows
from dapl_baselines.distillation.iteration_report import DistillationReport
from dapl_baselines.distillation.settings import DistillationSettings
from dapl_baselines.distillation.student import Student
from dapl_baselines.distillation.student_env import StudentEnv
from dapl_baselines.distillation.teacher import Teacher
from dapl_baselines.distillation.training_state import read_state, write_state
from dapl_baselines.look import Lookout
from dapl_baselines.policy.encoder_source import EncoderSource
from dapl_baselines.policy.training import ARCHITECTURE
from dapl_baselines.replay import Replay
from dapl_baselines.run_folder import claim
from dapl_baselines.training_history import environment_record
from dapl_baselines.training_report import Standing
from dapl_baselines.validation import TrainingScenes
from dapl_baselines.validation_run import Observer, ValidationResult, ignore

RUN_FILE, STATE_FILE, REPLAY_FOLDER = "run.json", "state.pt", "replay"
WHAT: Final = "distillation"


class DistillationRecord(FileModel):
    """``run.json``: everything that the outcome of a distillation depends on.

    Attributes:
        schema_version: Of these fields.
        settings: Student, rollouts, losses.
        teacher: The teacher's name.
        teacher_sha256: Its policy hash.
        training_sha256: The scenes trained on.
        validation_sha256: The scenes watched on.
        encoder_sha256: The encoder's weights, at first.
    """

    schema_version: Literal[1] = 1
    settings: DistillationSettings
    teacher: str
    teacher_sha256: str
    training_sha256: str
    validation_sha256: str
    encoder_sha256: str


class Distillation:
    """One distillation in one folder, new or continued.

    Args:
        scenes: What is trained and watched on.
        settings: Everything the user chooses; its network's encoder is replaced by that of ``encoder``.
        out: The folder.
        teacher: Any policy.
        encoder: The student's encoder.
        threads: Threads of the simulation; 0 for all cores.
        observe: Told of the episodes of a look, as they end.

    Attributes:
        standing: How far it is.

    Raises:
        InvalidValueError: The folder holds a distillation with other settings, or something else; or the teacher's
            latent does not fit.
        InvalidFileError: A file in it is damaged.
        StorageError: It cannot be written.
    """

    def __init__(
        self,
        scenes: TrainingScenes,
        settings: DistillationSettings,
        out: Path,
        *,
        teacher: Policy,
        encoder: EncoderSource,
        threads: int = 0,
        observe: Observer = ignore,
    ) -> None:
        network = settings.network.model_copy(update={"encoder": encoder.config})
        self.settings = settings.model_copy(update={"network": network})
        self._scenes, self._out, self._source, self._teacher = scenes, out, encoder, teacher
        self._threads = threads
        self._lookout = Lookout(
            folder=out, scenes=scenes.validation, max_steps=settings.max_steps, threads=threads, observe=observe
        )
        labels = Teacher(
            teacher, student_latent_size=network.fusion_sizes[-1], learns_latents=settings.latent_weight > 0
        )
        claim(out / RUN_FILE, self._record(), what=WHAT, may_change={"settings.iterations"})
        self._dagger = self._begin(labels)
        self.standing = Standing()
        if (out / STATE_FILE).is_file():
            self.standing = read_state(out / STATE_FILE, self._dagger)

    def run(self) -> Generator[DistillationReport, None, None]:
        """Make the iterations that are left; each is yielded when it is made and kept."""
        with closing(self._dagger.env), closing(Curves(self._out, self.standing.iteration)) as curves:
            while self.standing.iteration < self.settings.iterations:
                report = self._iterate()
                curves.add("training", report.iteration, report.curve_row())
                if report.validation is not None:
                    curves.add("validation", report.iteration, report.validation_row())
                write_state(self._out / STATE_FILE, self.standing, self._dagger)
                yield report

    def _begin(self, teacher: Teacher) -> Dagger:
        """The distillation at its start; a random encoder is first brought to the scale of what it sees."""
        settings = self.settings
        env = StudentEnv(self._scenes.training, settings, teacher.policy, threads=self._threads)
        env.reset(settings.seed)
        view = env.student_view()
        if not self._source.history:
            self._source.module.train().update_statistics(view.cloud)
        student = Student(settings, self._source)
        like = make_rows(view, student.to_stored(view.state, view.cloud), teacher.blank(settings.envs), settings)
        replay = Replay(self._out / REPLAY_FOLDER, like, settings.stored_rows)
        return Dagger(settings=settings, env=env, teacher=teacher, student=student, replay=replay)

    def _iterate(self) -> DistillationReport:
        """One rollout, its updates, and a look at the validation scenes if it is time for one."""
        start, before = time.monotonic(), self.standing.iteration
        losses, episodes = self._dagger.iterate(before), self._dagger.env.tally.take()
        number, seconds = before + 1, self.standing.seconds + time.monotonic() - start
        self.standing = replace(self.standing, iteration=number, seconds=seconds)
        is_time = number % self.settings.evaluate_every == 0 or number == self.settings.iterations
        return DistillationReport(
            iteration=number,
            environment_steps=number * self.settings.rollout_rows,
            seconds=seconds,
            teacher_share=self.settings.teacher_share(before),
            episodes=episodes,
            losses=losses,
            validation=self._look() if is_time else None,
        )

    def _look(self) -> ValidationResult:
        """Write the student, and see how it does as it was written, on what is there to be seen without errors."""
        result, self.standing = self._lookout.look(self._write_student, self.standing)
        return result

    def _write_student(self, path: Path) -> None:
        teacher = {"teacher": self._teacher.name, "teacher_sha256": self._teacher.policy_hash}
        record = environment_record(
            WHAT,
            steps=self.standing.iteration * self.settings.rollout_rows,
            seed=self.settings.seed,
            scenes=self._scenes,
            settings=self.settings,
            **teacher,
        )
        write_checkpoint(
            path,
            architecture=ARCHITECTURE,
            config=self.settings.network,
            module=cast(nn.Module, self._dagger.student.network),
            history=(*self._source.history, record),
            precision=self.settings.stored_precision,
        )

    def _record(self) -> DistillationRecord:
        return DistillationRecord(
            settings=self.settings,
            teacher=self._teacher.name,
            teacher_sha256=self._teacher.policy_hash,
            training_sha256=self._scenes.training.sha256,
            validation_sha256=self._scenes.validation.sha256,
            encoder_sha256=self._source.sha256,
        )
