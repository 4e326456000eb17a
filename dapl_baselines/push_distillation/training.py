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

from collections.abc import Callable
from copy import deepcopy
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal

import torch

from clutter6d.errors import Clutter6DError, InvalidFileError, InvalidValueError
from clutter6d.schema import FileModel
from clutter6d.seeding import generator
from dapl_baselines.checkpoint import Checkpoint, TrainingRecord, write_checkpoint
from dapl_baselines.code_hash import code_sha256
from dapl_baselines.policy.encoder_source import EncoderSource
from dapl_baselines.push_distillation.learner import StudentLearner, StudentLosses
from dapl_baselines.push_distillation.practice import StudentPractice
from dapl_baselines.push_distillation.settings import PushDistillationSettings
from dapl_baselines.push_policy.critic import PushCritic
from dapl_baselines.push_policy.push_slots_state import pack_slots, restore_slots
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.replay import Replay
from dapl_baselines.run_folder import claim
from dapl_baselines.tensor_file import read_tensor_file
from dapl_baselines.training_report import Standing, TrainingReport
from dapl_baselines.validation import TrainingScenes
from dapl_baselines.validation_run import Observer, ValidationResult, ignore
from dapl_baselines.watched_training import STATE_FILE, WatchedTraining, read_targets, side_by_side

ARCHITECTURE: Final = "push-student"
FORMAT: Final = "clutter6d-push-distillation-1"
RUN_FILE, REPLAY_FOLDER = "run.json", "replay"
_DAMAGED: Final = "not the state of this distillation; give another --out, or delete the folder to begin anew"


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


@dataclass(frozen=True, kw_only=True, slots=True)
class StudentReport(TrainingReport):
    """Practice, and what was learned beside it.

    Attributes:
        lessons: States that the teacher has judged since the beginning.
        losses: Mean losses of the iteration; ``None`` while there is too little to learn from.
    """

    lessons: int
    losses: StudentLosses | None


class PushDistillation(WatchedTraining[StudentReport]):
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
        critic = _critic_of(teacher, objects=len(scenes.training.scenes[0].objects))
        student = settings.student.model_copy(update={"encoder": encoder.config})
        self.settings = settings.model_copy(update={"student": student})
        super().__init__(scenes, self.settings, out, threads=threads, observe=observe)
        record = PushDistillationRecord(
            settings=self.settings,
            teacher_sha256=teacher.header.weights_sha256,
            encoder_sha256=encoder.sha256,
            training_sha256=scenes.training.sha256,
            validation_sha256=scenes.validation.sha256,
        )
        claim(out / RUN_FILE, record, what="distillation of pushes", may_change={"settings.iterations"})
        self._history = encoder.history
        self._learner = StudentLearner(self.settings, encoder)
        shapes = TargetShapes.of(read_targets(scenes.training, observe))
        self._practice = StudentPractice(scenes.training, shapes, self.settings, critic, threads=threads)
        blank = self._practice.blank_rows(self._learner.student)
        self._replay = Replay(out / REPLAY_FOLDER, blank, self.settings.kept)
        if (out / STATE_FILE).is_file():
            self.standing = self._read_state(out / STATE_FILE)
        self._acting = self._learner.acting_copy()

    def _make_iteration(self, iteration: int) -> Callable[[ValidationResult | None], StudentReport]:
        """Practice and learning side by side."""
        settings, learner, replay = self.settings, self._learner, self._replay
        self._acting.load_state_dict(learner.student.state_dict())
        share, rng = settings.teacher_share(iteration), generator(settings.seed, "student practice", iteration)
        practise = partial(self._practice.run, self._acting, share, replay, rng)
        learn = partial(learner.learn, replay, replay.count, generator(settings.seed, "student learning", iteration))
        _, losses = side_by_side(practise, learn if replay.count >= settings.warm_up else lambda: None)
        episodes = self._practice.slots.tally.take()

        def report(look: ValidationResult | None) -> StudentReport:
            return StudentReport(
                iteration=self.standing.iteration,
                environment_steps=self._environment_steps,
                seconds=self.standing.seconds,
                episodes=episodes,
                lessons=replay.count,
                losses=losses,
                validation=look,
            )

        return report

    def _curve_row(self, report: StudentReport) -> dict[str, float]:
        nothing = dict.fromkeys(StudentLosses.__dataclass_fields__, float("nan"))
        return {
            "environment_steps": report.environment_steps,
            "lessons": report.lessons,
            **asdict(report.episodes),
            **(nothing if report.losses is None else asdict(report.losses)),
            "timing_seconds": report.seconds,
        }

    def _state(self) -> dict[str, object]:
        return {
            "format": FORMAT,
            **asdict(self.standing),
            "student": deepcopy(self._learner.student.state_dict()),
            "optimizer": deepcopy(self._learner.optimizer.state_dict()),
            "updates": self._learner.updates,
            "replay_count": self._replay.count,
            "slots": pack_slots(self._practice.slots),
            "must_choose": torch.from_numpy(self._practice.must_choose.copy()),
        }

    def _read_state(self, path: Path) -> Standing:
        state = read_tensor_file(path, what="training state")
        if state.get("format") != FORMAT:
            raise InvalidFileError(path, _DAMAGED)
        try:
            self._restore(state)
            return Standing.of_state(state)
        except (KeyError, TypeError, ValueError, AttributeError, RuntimeError, IndexError, Clutter6DError) as error:
            reason = " ".join(str(error).split())[:120]
            raise InvalidFileError(path, f"{_DAMAGED} ({type(error).__name__}: {reason})") from None

    def _restore(self, state: dict[str, Any]) -> None:
        self._learner.student.load_state_dict(state["student"])
        self._learner.optimizer.load_state_dict(state["optimizer"])
        self._learner.updates, self._replay.count = int(state["updates"]), int(state["replay_count"])
        restore_slots(self._practice.slots, state["slots"])
        self._practice.must_choose = state["must_choose"].numpy().copy()

    def _write_policy(self, path: Path) -> None:
        record = TrainingRecord(
            method="push-distillation",
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
            config=self.settings.student,
            module=self._learner.student,
            history=(*self._history, record),
            precision=self.settings.stored_precision,
        )

    @property
    def _environment_steps(self) -> int:
        return self.standing.iteration * self.settings.steps * self.settings.slots


def _critic_of(teacher: Checkpoint, *, objects: int) -> PushCritic:
    critic = teacher.module
    if not isinstance(critic, PushCritic):
        raise InvalidValueError(f"the teacher is a {teacher.header.architecture}; give one of dapl train teacher")
    known = critic.config.obstacles + 1
    if known != objects:
        raise InvalidValueError(f"the teacher knows scenes of {known} objects, not of {objects}; choose others")
    return critic.eval().requires_grad_(False)
