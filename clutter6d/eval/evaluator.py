"""An evaluation on disk: resumable, one small file for each finished episode, tables at the end.

run.json                            everything the outcome depends on
journal/<scene_id>@<pair>.json      one finished episode: its row and its actions
floor/<scene_id>@<pair>.json        the same episode without any action
unstable/<scene_id>@<pair>-<step>.json  the state before a simulation step that became invalid, if one did
episodes.parquet, actions.parquet   all episodes, by scene and pair; one row a control step
report.json, report.md              the table
"""

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import mujoco
import numpy as np

from clutter6d import __version__
from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.action import ActionConfig
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import MAX_CONTROL_STEPS, TerminationConfig
from clutter6d.errors import InvalidFileError, InvalidValueError
from clutter6d.eval.builtin_policies import ZeroPolicy
from clutter6d.eval.episode import EpisodeRecord, EpisodeRow, episode_path, read_episode, write_episode
from clutter6d.eval.policy import Policy
from clutter6d.eval.report import Report, RunSettings, make_report, to_markdown
from clutter6d.eval.runner import EpisodeKey, EpisodeRunner
from clutter6d.eval.sample import sample_scene_ids
from clutter6d.eval.tables import write_actions, write_rows
from clutter6d.schema import read_model, write_bytes, write_model

ENGINE = f"mujoco {mujoco.__version__}"
RUN_FILE, REPORT_FILE, TABLE_FILE = "run.json", "report.json", "report.md"
Part = Literal["journal", "floor"]

_log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True, slots=True)
class EvaluationConfig:
    """What the user chooses beside scenes and policy.

    Attributes:
        pairs: Goal pairs of each scene that are attempted, the first ones; ``None`` for all.
        sample: Scenes that are attempted, drawn at random and the same for everyone; ``None`` for all.
        seed: Seed of everything that a policy draws.
        max_steps: Control steps of an episode at most; another number than 300 makes the table not official.
        action: How actions are mapped.
    """

    pairs: int | None = None
    sample: int | None = None
    seed: int = 0
    max_steps: int = MAX_CONTROL_STEPS
    action: ActionConfig = field(default_factory=ActionConfig)

    def __post_init__(self) -> None:
        """Refuse an evaluation of nothing."""
        if self.pairs is not None and self.pairs < 1:
            raise InvalidValueError(f"pairs is {self.pairs}; at least 1 is needed")

    def env(self) -> EnvConfig:
        """The environment's configuration."""
        return EnvConfig(action=self.action, termination=TerminationConfig(max_steps=self.max_steps))


class Evaluation:
    """One evaluation in one folder, new or continued.

    Args:
        scenes: Scenes and assets.
        policy: What is evaluated.
        out: The folder.
        config: What the user chooses.

    Raises:
        InvalidValueError: The folder holds an evaluation with other settings, or something else; or no scene has so
            many goal pairs.
        InvalidFileError: The folder's ``run.json`` is damaged.
        StorageError: It cannot be written.
    """

    def __init__(
        self, scenes: SceneCollection, policy: Policy, out: Path, config: EvaluationConfig | None = None
    ) -> None:
        self._scenes, self._policy, self._out = scenes, policy, out
        self._config = config or EvaluationConfig()
        _check_pairs(scenes, self._config.pairs)
        self.keys = episode_keys(scenes, self._config.pairs, self._config.sample)
        self.settings = make_settings(scenes, policy, self._config)
        _claim(out, self.settings)

    def finished(
        self, part: Part = "journal", *, keys: Sequence[EpisodeKey] | None = None
    ) -> dict[EpisodeKey, EpisodeRecord]:
        """The episodes that are done, by scene and pair; of some ``keys`` only, if given.

        Raises:
            InvalidFileError: One of them is damaged, or is another episode's.
        """
        paths = {key: episode_path(self._out / part, *key) for key in (self.keys if keys is None else keys)}
        records = {key: read_episode(path) for key, path in paths.items() if path.is_file()}
        for key, record in records.items():
            if record.row.key != key:
                scene_id, pair = record.row.key
                raise InvalidFileError(paths[key], f"holds the episode of {scene_id} pair {pair}; delete it")
        return records

    def run(
        self,
        part: Part = "journal",
        *,
        keys: Sequence[EpisodeKey] | None = None,
        num_envs: int = 16,
        threads: int = 0,
    ) -> Iterator[EpisodeRow]:
        """Run what is not done yet, and keep each episode as soon as it ends.

        Args:
            part: The policy's own episodes, or the same without any action.
            keys: Scene and pair of the episodes to run; by default all.
            num_envs: Episodes at once; the outcome does not depend on it.
            threads: Threads of the simulation, 0 for all cores; the outcome does not depend on it.
        """
        wanted = self.keys if keys is None else keys
        done = self.finished(part, keys=wanted)
        runner = EpisodeRunner(
            self._scenes,
            self._policy if part == "journal" else ZeroPolicy(),
            config=self._config.env(),
            seed=self._config.seed,
            num_envs=num_envs,
            threads=threads,
            unstable_dir=self._out / "unstable",
        )
        for record in runner.run([key for key in wanted if key not in done]):
            write_episode(self._out / part, record)
            yield record.row

    def finish(self) -> Report:
        """Write the tables; every episode must be done.

        Raises:
            InvalidValueError: Some episodes are not.
        """
        records, floor = self.finished("journal"), self.finished("floor")
        if len(records) < len(self.keys) or len(floor) < len(self.keys):
            raise InvalidValueError(f"{self._out}: {len(self.keys) - len(records)} episodes are missing; run it again")
        ordered = [records[key] for key in self.keys]
        rows = [record.row for record in ordered]
        report = make_report(self.settings, rows, mean_floor([floor[key].row for key in self.keys]))
        write_rows(self._out, rows)
        write_actions(self._out, ordered)
        write_bytes(self._out / TABLE_FILE, to_markdown(report).encode())
        write_model(self._out / REPORT_FILE, report)
        return report


def episode_keys(scenes: SceneCollection, pairs: int | None, sample: int | None = None) -> tuple[EpisodeKey, ...]:
    """Scene and pair of every episode, in the table's order; of all scenes, or of a sample.

    Raises:
        InvalidValueError: There are not so many scenes as the sample should have.
    """
    counts = {scene.scene_id: len(scene.goal_pairs) for scene in scenes.scenes}
    names = sorted(counts) if sample is None else sample_scene_ids(scenes, sample)
    return tuple((name, pair) for name in names for pair in range(min(pairs or counts[name], counts[name])))


def mean_floor(rows: Sequence[EpisodeRow]) -> float:
    """The zero-action mean offset [cm]."""
    return float(np.mean([row.mean_offset_cm for row in rows]))


def make_settings(scenes: SceneCollection, policy: Policy, config: EvaluationConfig) -> RunSettings:
    """Everything that the outcome depends on."""
    most = max(len(scene.goal_pairs) for scene in scenes.scenes)
    return RunSettings(
        policy=policy.name,
        policy_hash=policy.policy_hash,
        policy_is_privileged=policy.is_privileged,
        tracks=tuple(sorted({scene.track for scene in scenes.scenes})),
        split_sha256=scenes.sha256,
        scenes=len(scenes.scenes),
        pairs=min(config.pairs or most, most),
        sample=config.sample,
        seed=config.seed,
        max_steps=config.max_steps,
        action_scale_rad=config.action.action_scale_rad,
        max_hand_step_m=config.action.max_hand_step_m,
        damping=config.action.damping,
        engine=ENGINE,
        clutter6d=__version__,
    )


def _check_pairs(scenes: SceneCollection, pairs: int | None) -> None:
    most = max(len(scene.goal_pairs) for scene in scenes.scenes)
    if pairs is not None and pairs > most:
        raise InvalidValueError(
            f"pairs is {pairs}, but no scene has more than {most}; choose at most {most}, or leave it out"
        )


def _claim(out: Path, settings: RunSettings) -> None:
    """Make the folder this evaluation's, or find that it already is."""
    path = out / RUN_FILE
    if path.is_file():
        before = read_model(path, RunSettings, what="evaluation").model_dump()
        now: Mapping[str, object] = settings.model_dump()
        changed = [f"{name} was {before[name]}, is {now[name]}" for name in now if before[name] != now[name]]
        if changed:
            raise InvalidValueError(
                f"{out} is of an evaluation with other settings ({changed[0]}); choose another --out"
            )
        return
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InvalidValueError(f"{out} is neither an empty folder nor an evaluation; choose another --out")
    write_model(path, settings)
