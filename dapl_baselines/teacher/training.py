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
from functools import partial
from pathlib import Path
from typing import Final, Literal

from clutter6d.schema import FileModel
from clutter6d.seeding import generator
from dapl_baselines.checkpoint import Checkpoint
from dapl_baselines.push_policy.critic import PushCritic
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.push_training import STATE_FILE, PushTraining, read_targets, side_by_side
from dapl_baselines.replay import Replay
from dapl_baselines.run_folder import claim
from dapl_baselines.teacher.iteration_report import TeacherReport
from dapl_baselines.teacher.learner import TeacherLearner
from dapl_baselines.teacher.practice import Practice
from dapl_baselines.teacher.settings import TeacherSettings
from dapl_baselines.teacher.trained_critic import critic_to_begin_with
from dapl_baselines.teacher.training_state import Course, copy_state, read_state
from dapl_baselines.validation import TrainingScenes
from dapl_baselines.validation_run import Observer, ignore

RUN_FILE, REPLAY_FOLDER = "run.json", "replay"
MAY_CHANGE: Final = {"settings.iterations", "settings.falling_updates"}
"""A training may be made longer or brought to its end sooner; its checkpoints say with what it was made last."""


class TeacherRecord(FileModel):
    """``run.json``: everything that the outcome of a teacher's training depends on.

    Attributes:
        schema_version: Of these fields.
        settings: Network, practice, losses.
        training_sha256: The scenes trained on.
        validation_sha256: The scenes watched on.
        start_sha256: Weights of the teacher that it begins with; empty: random ones.
    """

    schema_version: Literal[1] = 1
    settings: TeacherSettings
    training_sha256: str
    validation_sha256: str
    start_sha256: str = ""


class TeacherTraining(PushTraining[TeacherReport]):
    """One training in one folder, new or continued.

    Args:
        scenes: What is trained and watched on; all of as many objects.
        settings: Everything the user chooses; the critic's number of obstacles is that of the scenes.
        out: The folder.
        start: Checkpoint of a teacher that it begins with; ``None``: random weights.
        threads: Threads of the simulation; 0 for all cores.
        observe: Told of the targets that are read, and of the episodes of a look.

    Attributes:
        standing: How far it is.

    Raises:
        InvalidValueError: The folder holds a training with other settings, or something else; or ``start`` is no
            teacher of such scenes with the same network and prices.
        InvalidFileError: A file in it is damaged.
        StorageError: It cannot be written.
    """

    architecture = "push-critic"
    method = "push-critic"
    settings: TeacherSettings

    def __init__(
        self,
        scenes: TrainingScenes,
        settings: TeacherSettings,
        out: Path,
        *,
        start: Checkpoint | None = None,
        threads: int = 0,
        observe: Observer = ignore,
    ) -> None:
        obstacles = len(scenes.training.scenes[0].objects) - 1
        critic = settings.critic.model_copy(update={"obstacles": obstacles})
        settings = settings.model_copy(update={"critic": critic})
        super().__init__(scenes, settings, out, threads=threads, observe=observe)
        begun_with = None if start is None else critic_to_begin_with(start, settings.critic)
        record = TeacherRecord(
            settings=self.settings,
            training_sha256=scenes.training.sha256,
            validation_sha256=scenes.validation.sha256,
            start_sha256="" if start is None else start.header.weights_sha256,
        )
        claim(out / RUN_FILE, record, what="teacher's training", may_change=MAY_CHANGE)
        self._history = () if start is None else start.header.history
        shapes = TargetShapes.of(read_targets(scenes.training, observe))
        learner = TeacherLearner(self.settings, shapes)
        if begun_with is not None:
            learner.begin_with(begun_with)
        practice = Practice(scenes.training, shapes, self.settings, threads=threads)
        replay = Replay(out / REPLAY_FOLDER, practice.blank_rows(), self.settings.kept)
        self._course = Course(learner=learner, practice=practice, replay=replay)
        if (out / STATE_FILE).is_file():
            self.standing = read_state(out / STATE_FILE, self._course)
        self._acting = copy.deepcopy(learner.critic).requires_grad_(False)

    def _make_iteration(self, iteration: int) -> TeacherReport:
        """Practice and learning side by side."""
        course, seed, end = self._course, self.settings.seed, self._course.replay.count
        self._acting.load_state_dict(course.learner.critic.state_dict())
        practise = partial(course.practice.run, self._acting, course.replay, generator(seed, "practice", iteration))
        learn = partial(course.learner.learn, course.replay, end, generator(seed, "learning", iteration))
        _, losses = side_by_side(practise, learn if end >= self.settings.warm_up else lambda: None)
        return TeacherReport(
            iteration=iteration + 1,
            environment_steps=self._environment_steps(iteration + 1),
            episodes=course.practice.slots.tally.take(),
            pushes=course.replay.count,
            updates=course.learner.updates,
            losses=losses,
        )

    def _state(self) -> dict[str, object]:
        return copy_state(self.standing, self._course)

    def _network(self) -> PushCritic:
        return self._course.learner.critic
