"""Where the recorded episodes come from: an evaluation's folder, finished or not."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.errors import InvalidValueError, MissingFileError
from clutter6d.eval.episode import EpisodeRecord, episode_path, read_episode
from clutter6d.eval.evaluator import ENGINE, REPORT_FILE, RUN_FILE, episode_keys
from clutter6d.eval.report import Report, RunSettings
from clutter6d.eval.runner import EpisodeKey
from clutter6d.eval.tables import read_actions, read_rows
from clutter6d.schema import read_model

JOURNAL = "journal"


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class RecordedEpisodes:
    """Finished episodes with their actions, and the scenes they were made on.

    Attributes:
        scenes: The scenes.
        settings: Everything that the episodes depend on.
        records: Row and actions of each.
    """

    scenes: SceneCollection
    settings: RunSettings
    records: tuple[EpisodeRecord, ...]

    @property
    def keys(self) -> tuple[EpisodeKey, ...]:
        """Scene and pair of each, in order."""
        return tuple(record.row.key for record in self.records)

    def chosen(self, *, count: int | None = None, only_successes: bool = False) -> "RecordedEpisodes":
        """The first episodes, or the successes among them.

        Args:
            count: How many to look at; by default all. Every scene's first pair comes before any scene's second.
            only_successes: Whether to leave out what did not succeed.

        Raises:
            InvalidValueError: Nothing is left.
        """
        by_key = {record.row.key: record for record in self.records}
        records = [by_key[key] for key in sorted(spread_keys(self.keys, count))]
        kept = tuple(record for record in records if record.row.is_success or not only_successes)
        if not kept:
            raise InvalidValueError(f"none of {len(records)} episodes is a success: nothing to record")
        return replace(self, records=kept)


def spread_keys(keys: Sequence[EpisodeKey], count: int | None) -> tuple[EpisodeKey, ...]:
    """The first so many episodes, over as many scenes as there are: first pairs, then second ones, and so on."""
    return tuple(sorted(keys, key=lambda key: (key[1], key[0]))[:count])


def read_evaluation(folder: Path, scenes: SceneCollection) -> RecordedEpisodes:
    """The episodes of an evaluation; of an unfinished one, those that have ended.

    Args:
        folder: What ``evaluate`` or ``teleop`` wrote.
        scenes: The scenes it was made on.

    Raises:
        MissingFileError: There is no evaluation.
        InvalidFileError: A file of it is damaged.
        InvalidValueError: The scenes are others, the engine is another version, or no episode has ended.
    """
    if (folder / REPORT_FILE).is_file():
        settings = read_model(folder / REPORT_FILE, Report, what="report").settings
        actions = read_actions(folder)
        records = [EpisodeRecord(row=row, actions=actions[row.key]) for row in read_rows(folder) if row.key in actions]
    elif (folder / RUN_FILE).is_file():
        settings = read_model(folder / RUN_FILE, RunSettings, what="evaluation")
        paths = (episode_path(folder / JOURNAL, *key) for key in episode_keys(scenes, settings.pairs))
        records = [read_episode(path) for path in paths if path.is_file()]
    else:
        raise MissingFileError("evaluation", folder, "make one with: clutter6d evaluate")
    _check_origin(folder, settings, scenes)
    known = set(episode_keys(scenes, None))
    stray = next((record.row for record in records if record.row.key not in known), None)
    if stray is not None:
        raise InvalidValueError(f"{folder}: its scenes have no {stray.scene_id} pair {stray.pair}")
    if not records:
        raise InvalidValueError(f"{folder}: no episode has ended yet: nothing to record")
    return RecordedEpisodes(scenes=scenes, settings=settings, records=tuple(records))


def _check_origin(folder: Path, settings: RunSettings, scenes: SceneCollection) -> None:
    if settings.split_sha256 != scenes.sha256:
        raise InvalidValueError(
            f"the evaluation {folder} was made on other scenes (SHA-256 {settings.split_sha256[:12]}, these are "
            f"{scenes.sha256[:12]}); give the right ones by --scenes"
        )
    if settings.engine != ENGINE:
        raise InvalidValueError(f"the evaluation {folder} ran on {settings.engine}, this is {ENGINE}; install that")
