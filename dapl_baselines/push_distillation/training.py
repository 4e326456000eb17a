"""A distillation of pushes in a folder: continued where it was stopped, watched on the validation scenes.

run.json            everything the outcome depends on
state.pt            how far it is: student, optimiser, every episode's simulation
replay/             what it learns from
training.csv        one row an iteration: losses, and what became of the episodes
validation.csv      one row a look at the validation scenes
policy.pt, best.pt  the student at the last look, and at the best
tensorboard/        the same curves

As a teacher's training, it practises with the network of the iteration before while it learns from what there was.
"""

from functools import partial
from pathlib import Path
from typing import Literal

from clutter6d.schema import FileModel
from clutter6d.seeding import generator
from dapl_baselines.checkpoint import Checkpoint
from dapl_baselines.policy.encoder_source import EncoderSource
from dapl_baselines.push_distillation.iteration_report import StudentReport
from dapl_baselines.push_distillation.learner import StudentLearner
from dapl_baselines.push_distillation.practice import StudentPractice
from dapl_baselines.push_distillation.settings import PushDistillationSettings
from dapl_baselines.push_distillation.training_state import Course, copy_state, read_state
from dapl_baselines.push_policy.student import PushStudent
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.push_training import STATE_FILE, PushTraining, read_targets, side_by_side
from dapl_baselines.replay import Replay
from dapl_baselines.run_folder import claim
from dapl_baselines.teacher.trained_critic import critic_of
from dapl_baselines.validation import TrainingScenes
from dapl_baselines.validation_run import Observer, ignore

RUN_FILE, REPLAY_FOLDER = "run.json", "replay"


class PushDistillationRecord(FileModel):
    """``run.json``: everything that the outcome of a distillation depends on.

    Attributes:
        schema_version: Of these fields.
        settings: Student, practice, losses.
        teacher_sha256: The teacher's weights.
        encoder_sha256: The encoder's weights.
        training_sha256: The scenes trained on.
        validation_sha256: The scenes watched on.
    """

    schema_version: Literal[1] = 1
    settings: PushDistillationSettings
    teacher_sha256: str
    encoder_sha256: str
    training_sha256: str
    validation_sha256: str


class PushDistillation(PushTraining[StudentReport]):
    """One distillation in one folder, new or continued.

    Args:
        scenes: What is trained and watched on.
        settings: Everything the user chooses; its network's encoder is replaced by that of ``encoder``.
        out: The folder.
        teacher: Checkpoint of a privileged critic.
        encoder: The student's encoder.
        threads: Threads of the simulation; 0 for all cores.
        observe: Told of the targets that are read, and of the episodes of a look.

    Raises:
        InvalidValueError: The teacher is no critic of pushes, or of scenes with another number of objects; or the
            folder holds a distillation with other settings, or something else.
        InvalidFileError: A file in it is damaged.
        StorageError: It cannot be written.
    """

    architecture = "push-student"
    method = "push-distillation"
    settings: PushDistillationSettings

    def __init__(
        self,
        scenes: TrainingScenes,
        settings: PushDistillationSettings,
        out: Path,
        *,
        teacher: Checkpoint,
        encoder: EncoderSource,
        threads: int = 0,
        observe: Observer = ignore,
    ) -> None:
        critic = critic_of(teacher, objects=len(scenes.training.scenes[0].objects))
        student = settings.student.model_copy(update={"encoder": encoder.config})
        settings = settings.model_copy(update={"student": student})
        super().__init__(scenes, settings, out, threads=threads, observe=observe)
        record = PushDistillationRecord(
            settings=self.settings,
            teacher_sha256=teacher.header.weights_sha256,
            encoder_sha256=encoder.sha256,
            training_sha256=scenes.training.sha256,
            validation_sha256=scenes.validation.sha256,
        )
        claim(out / RUN_FILE, record, what="distillation of pushes", may_change={"settings.iterations"})
        self._history = encoder.history
        learner = StudentLearner(self.settings, encoder)
        shapes = TargetShapes.of(read_targets(scenes.training, observe))
        practice = StudentPractice(scenes.training, shapes, self.settings, critic, threads=threads)
        replay = Replay(out / REPLAY_FOLDER, practice.blank_rows(learner.student), self.settings.kept)
        self._course = Course(learner=learner, practice=practice, replay=replay)
        if (out / STATE_FILE).is_file():
            self.standing = read_state(out / STATE_FILE, self._course)
        self._acting = learner.acting_copy()

    def _make_iteration(self, iteration: int) -> StudentReport:
        """Practice and learning side by side."""
        settings, course, end = self.settings, self._course, self._course.replay.count
        self._acting.load_state_dict(course.learner.student.state_dict())
        share, rng = settings.teacher_share(iteration), generator(settings.seed, "student practice", iteration)
        practise = partial(course.practice.run, self._acting, share, course.replay, rng)
        rng = generator(settings.seed, "student learning", iteration)
        learn = partial(course.learner.learn, course.replay, end, rng)
        _, losses = side_by_side(practise, learn if end >= settings.warm_up else lambda: None)
        return StudentReport(
            iteration=iteration + 1,
            environment_steps=self._environment_steps(iteration + 1),
            episodes=course.practice.slots.tally.take(),
            lessons=course.replay.count,
            losses=losses,
        )

    def _state(self) -> dict[str, object]:
        return copy_state(self.standing, self._course)

    def _network(self) -> PushStudent:
        return self._course.learner.student
