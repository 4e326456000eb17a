"""Simulating recorded actions again: does the same come of them, to the bit?"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Int

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.action import ACTION_SIZE
from clutter6d.errors import InvalidFileError, InvalidValueError
from clutter6d.eval.builtin_policies import ZeroPolicy
from clutter6d.eval.episode import EpisodeRow
from clutter6d.eval.evaluator import ENGINE, REPORT_FILE, episode_keys, mean_floor
from clutter6d.eval.policy import Episode, PolicyInput
from clutter6d.eval.report import Report, make_report
from clutter6d.eval.runner import EpisodeKey, EpisodeRunner
from clutter6d.eval.tables import ACTIONS_FILE, EPISODES_FILE, read_actions, read_rows
from clutter6d.schema import read_model

Actions = Mapping[EpisodeKey, Float32[np.ndarray, "step 7"]]


@dataclass(frozen=True, kw_only=True, slots=True)
class Verdict:
    """What replaying one episode showed: the columns that differ; none if it is identical."""

    scene_id: str
    pair: int
    differing: tuple[str, ...]

    @property
    def is_identical(self) -> bool:
        """Whether outcome and every metric are the same to the bit."""
        return not self.differing


class RecordedPolicy:
    """Gives the recorded actions again, and zeros where the record has ended."""

    name = "recorded"
    policy_hash = ""
    is_privileged = False
    needs_observation = False

    def __init__(self, actions: Actions) -> None:
        self._actions = actions

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:
        """Nothing to remember."""

    def act(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
        """The recorded action of each episode's step."""
        out = np.zeros((len(inputs.slots), ACTION_SIZE), dtype=np.float32)
        for row, (episode, step) in enumerate(zip(inputs.episodes, inputs.steps, strict=True)):
            recorded = self._actions[episode.scene.scene_id, episode.pair_index]
            if step < len(recorded):
                out[row] = recorded[step]
        return out


class Replay:
    """A stored evaluation, to be checked by simulation.

    Args:
        folder: What ``evaluate`` wrote.
        scenes: The scenes it was made on.

    Raises:
        MissingFileError: A file of the evaluation is missing.
        InvalidFileError: A file is damaged, or the tables do not hold exactly the episodes that the report names.
        InvalidValueError: The scenes are others, or the engine is another version.
    """

    def __init__(self, folder: Path, scenes: SceneCollection) -> None:
        self._scenes = scenes
        self.report = read_model(folder / REPORT_FILE, Report, what="report")
        self._check_origin()
        self._rows = {row.key: row for row in read_rows(folder)}
        self._actions = read_actions(folder)
        self.keys = episode_keys(scenes, self.report.settings.pairs, self.report.settings.sample)
        for name, found in ((EPISODES_FILE, self._rows), (ACTIONS_FILE, self._actions)):
            if set(found) != set(self.keys):
                scene_id, pair = min(set(found) ^ set(self.keys))
                raise InvalidFileError(
                    folder / name, f"does not hold the episodes of the report: {scene_id} pair {pair}"
                )

    def run(self, *, num_envs: int = 16, threads: int = 0) -> Iterator[Verdict]:
        """Simulate every episode again, and compare its row."""
        for row in self._simulate(RecordedPolicy(self._actions), num_envs, threads):
            yield Verdict(scene_id=row.scene_id, pair=row.pair, differing=self._rows[row.key].differences(row))

    def check_report(self, *, num_envs: int = 16, threads: int = 0) -> tuple[str, ...]:
        """Names of the report's fields that do not follow from the stored rows and the scenes' floor."""
        floor = {row.key: row for row in self._simulate(ZeroPolicy(), num_envs, threads)}
        mean = mean_floor([floor[key] for key in self.keys])
        expected = make_report(self.report.settings, [self._rows[key] for key in self.keys], mean)
        return tuple(name for name in Report.model_fields if getattr(expected, name) != getattr(self.report, name))

    def _simulate(self, policy: RecordedPolicy | ZeroPolicy, num_envs: int, threads: int) -> Iterator[EpisodeRow]:
        settings = self.report.settings
        config = settings.env_config()
        runner = EpisodeRunner(
            self._scenes, policy, config=config, seed=settings.seed, num_envs=num_envs, threads=threads
        )
        return (record.row for record in runner.run(self.keys))

    def _check_origin(self) -> None:
        settings = self.report.settings
        if settings.split_sha256 != self._scenes.sha256:
            raise InvalidValueError(
                f"these are not the scenes of the evaluation: their SHA-256 is {self._scenes.sha256[:12]}, "
                f"the report names {settings.split_sha256[:12]}; give the right ones by --scenes"
            )
        if settings.engine != ENGINE:
            raise InvalidValueError(f"the evaluation ran on {settings.engine}, this is {ENGINE}; install that version")
