"""What is played: episodes in their order, of a policy that acts now or of one that was recorded."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.env_config import EnvConfig
from clutter6d.errors import InvalidValueError
from clutter6d.eval.episode import EpisodeRow
from clutter6d.eval.evaluator import episode_keys
from clutter6d.eval.policy import Policy
from clutter6d.eval.replay import RecordedPolicy, Replay
from clutter6d.eval.runner import EpisodeKey
from clutter6d.eval.tables import read_actions, read_rows


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Playlist:
    """Episodes to play.

    Attributes:
        scenes: Scenes and assets.
        keys: The episodes, by scene and pair; at least one.
        policy: What acts.
        title: What is said of it.
        config: Actions, reward and termination.
        seed: The evaluation's seed.
        rows: What came of the episodes when they were recorded; empty if they were not.
    """

    scenes: SceneCollection
    keys: tuple[EpisodeKey, ...]
    policy: Policy
    title: str
    config: EnvConfig = field(default_factory=EnvConfig)
    seed: int = 0
    rows: Mapping[EpisodeKey, EpisodeRow] = field(default_factory=dict[EpisodeKey, EpisodeRow])

    def __post_init__(self) -> None:
        """Refuse to play nothing."""
        if not self.keys:
            raise InvalidValueError("there is no episode to play: the scenes have no goal pairs")

    @property
    def scene_ids(self) -> tuple[str, ...]:
        """The scenes of the episodes, each once."""
        return tuple(dict.fromkeys(scene_id for scene_id, _ in self.keys))


def live_playlist(scenes: SceneCollection, policy: Policy, *, only: Sequence[str] = (), seed: int = 0) -> Playlist:
    """Every goal pair of every scene, or of ``only`` some, for a policy that acts now."""
    keys = tuple(key for key in episode_keys(scenes, None) if not only or key[0] in only)
    return Playlist(scenes=scenes, keys=keys, policy=policy, title=policy.name, seed=seed)


def recorded_playlist(folder: Path, scenes: SceneCollection) -> Playlist:
    """The episodes of a finished evaluation, simulated again from their recorded actions.

    Args:
        folder: What ``evaluate`` wrote.
        scenes: The scenes it was made on.

    Raises:
        MissingFileError: A file of the evaluation is missing.
        InvalidFileError: A file is damaged.
        InvalidValueError: The scenes are others, or the engine is another version.
    """
    replay = Replay(folder, scenes)
    settings = replay.report.settings
    return Playlist(
        scenes=scenes,
        keys=tuple(replay.keys),
        policy=RecordedPolicy(read_actions(folder)),
        title=f"{settings.policy} (recorded)",
        config=settings.env_config(),
        seed=settings.seed,
        rows={row.key: row for row in read_rows(folder)},
    )
