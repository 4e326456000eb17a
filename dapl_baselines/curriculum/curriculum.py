"""A curriculum in a folder: world model and policy in turn, unattended, continued where it was stopped.

curriculum.json    everything its outcome depends on
curriculum.csv     one row a round
curriculum.png     success over rounds
round-1, ...       what each round made (:mod:`dapl_baselines.curriculum.stages`)
"""

from collections.abc import Generator
from pathlib import Path
from typing import Final, Literal

from clutter6d.schema import FileModel, read_model, write_bytes, write_model
from dapl_baselines.curriculum.picture import draw_curriculum
from dapl_baselines.curriculum.round_result import RoundResult, to_csv
from dapl_baselines.curriculum.settings import CurriculumSettings
from dapl_baselines.curriculum.stages import Stages
from dapl_baselines.devices import find_device
from dapl_baselines.run_folder import claim
from dapl_baselines.validation import TrainingScenes
from dapl_baselines.validation_run import Observer, ignore
from dapl_baselines.world_model.picture import check_matplotlib

RUN_FILE, TABLE_FILE, PICTURE_FILE, ROUND_FILE = "curriculum.json", "curriculum.csv", "curriculum.png", "round.json"
WHAT: Final = "curriculum"


class CurriculumRecord(FileModel):
    """``curriculum.json``: everything that the outcome of a curriculum depends on.

    Attributes:
        schema_version: Of these fields.
        settings: What every round is made of.
        scenes: The scenes, as the user named them.
        training_sha256: The scenes trained on.
        validation_sha256: The scenes watched on.
        device: Where networks are trained: ``"cpu"`` or ``"cuda"``.
    """

    schema_version: Literal[1] = 1
    settings: CurriculumSettings
    scenes: str
    training_sha256: str
    validation_sha256: str
    device: str


class Curriculum:
    """One curriculum in one folder, new or continued; it may be given more rounds.

    Args:
        scenes: What is recorded, trained on and watched on.
        settings: Everything the user chooses.
        out: The folder.
        scenes_name: The scenes, as the user named them.
        device: Where networks are trained: ``"cpu"`` or ``"cuda"``.
        threads: Threads of the simulation; 0 for all cores.
        observe: Told which round and stage is at work, how much of it is done, and of how much.

    Attributes:
        settings: Everything the user chose.

    Raises:
        InvalidValueError: The folder holds a curriculum with other settings, or something else; or there is no such
            device.
        InvalidFileError: A file in it is damaged.
        MissingDependencyError: matplotlib, which draws the picture, is not installed.
        StorageError: It cannot be written.
    """

    def __init__(
        self,
        scenes: TrainingScenes,
        settings: CurriculumSettings,
        out: Path,
        *,
        scenes_name: str,
        device: str = "cpu",
        threads: int = 0,
        observe: Observer = ignore,
    ) -> None:
        check_matplotlib()
        self.settings, self._out, where = settings, out, find_device(device)
        record = CurriculumRecord(
            settings=settings,
            scenes=scenes_name,
            training_sha256=scenes.training.sha256,
            validation_sha256=scenes.validation.sha256,
            device=where.type,
        )
        claim(out / RUN_FILE, record, what=WHAT, may_change={"settings.rounds"})
        self._stages = Stages(
            scenes, settings, out, scenes_name=scenes_name, device=where, threads=threads, observe=observe
        )
        self._results = self._read_results()

    @property
    def results(self) -> tuple[RoundResult, ...]:
        """What came of the rounds that are over."""
        return tuple(self._results)

    def run(self) -> Generator[RoundResult, None, None]:
        """Make the rounds that are left; each is yielded when it is over and kept.

        Stopped within a stage, it loses what that stage loses: seconds of a training, or the episodes under way.
        """
        if self._results:
            self._show()
        while len(self._results) < self.settings.rounds:
            self._results.append(self._make_round(len(self._results) + 1))
            self._show()
            yield self._results[-1]

    def _make_round(self, number: int) -> RoundResult:
        self._stages.record(number)
        report = self._stages.train_world_model(number)
        seconds = self._stages.train_policy(number)
        result = RoundResult(
            round=number,
            recorded_steps=report.data.training + report.data.validation,
            errors=report.held_out["moving_objects"],
            validation=self._stages.evaluate(number),
            world_model_minutes=report.minutes,
            policy_minutes=seconds / 60,
        )
        write_model(self._stages.folder(number) / ROUND_FILE, result)
        return result

    def _show(self) -> None:
        """Write the table and the picture."""
        write_bytes(self._out / TABLE_FILE, to_csv(self._results))
        write_bytes(self._out / PICTURE_FILE, draw_curriculum(self._results))

    def _read_results(self) -> list[RoundResult]:
        results = list[RoundResult]()
        while (path := self._stages.folder(len(results) + 1) / ROUND_FILE).is_file():
            results.append(read_model(path, RoundResult, what="result of a round"))
        return results
