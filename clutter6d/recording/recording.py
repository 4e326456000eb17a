"""Recording episodes one after another into one or more formats, so that what is finished survives a kill."""

import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal, Protocol, runtime_checkable

from clutter6d.assets.asset import Asset
from clutter6d.errors import InvalidValueError
from clutter6d.eval.report import RunSettings
from clutter6d.eval.runner import EpisodeKey
from clutter6d.recording.rollout import Rollout, simulate_rollout
from clutter6d.recording.source import RecordedEpisodes
from clutter6d.scene import Scene
from clutter6d.schema import FileModel, read_model, write_model
from clutter6d.sim.scene_model import SceneModel, compile_stored_scene


class RecordingSettings(FileModel):
    """What a recording depends on besides its episodes.

    Attributes:
        run: The evaluation that the episodes are of.
        point_clouds: Whether point clouds are kept.
        cameras: Names of the cameras.
        width: Of the pictures [px]; 0 without pictures.
        height: Of the pictures [px]; 0 without pictures.
        fps: Pictures a second of a video; 0 without pictures.
    """

    schema_version: Literal[1] = 1
    run: RunSettings
    point_clouds: bool = False
    cameras: tuple[str, ...] = ()
    width: int = 0
    height: int = 0
    fps: int = 0


@runtime_checkable
class Recorder(Protocol):
    """One format of a recording."""

    def has(self, key: EpisodeKey) -> bool:
        """Whether an episode is recorded already."""
        ...

    def add(self, rollout: Rollout, scene: Scene, model: SceneModel) -> None:
        """Record an episode; when this returns, a kill no longer loses it."""
        ...

    def finish(self) -> Path:
        """Put the whole together; returns where it is."""
        ...


def record_episodes(
    episodes: RecordedEpisodes, recorders: Sequence[Recorder], *, point_clouds: bool = False
) -> Iterator[EpisodeKey]:
    """Record all episodes with all recorders, those that are not recorded yet; yields each as it is done.

    Args:
        episodes: The episodes.
        recorders: What writes them; finished by the caller.
        point_clouds: Whether to simulate with point clouds.

    Raises:
        InvalidValueError: An episode's actions lead to another end than the one recorded.
        StorageError: The disk is full, or the folder cannot be written.
    """
    settings = episodes.settings
    config = settings.env_config()
    scenes = {scene.scene_id: scene for scene in episodes.scenes.scenes}
    compiled: tuple[str, SceneModel] | None = None
    for record in episodes.records:
        key, scene = record.row.key, scenes[record.row.scene_id]
        wanting = [recorder for recorder in recorders if not recorder.has(key)]
        if wanting:
            if compiled is None or compiled[0] != scene.scene_id:
                compiled = scene.scene_id, compile_stored_scene(scene, episodes.scenes.assets_of(scene))
            rollout = simulate_rollout(compiled[1], scene, record, config, point_clouds=point_clouds)
            for recorder in wanting:
                recorder.add(rollout, scene, compiled[1])
        yield key


def assets_by_hash(model: SceneModel) -> dict[str, Asset]:
    """A scene's assets by content hash."""
    return {asset.content_hash: asset for asset in model.assets}


def claim(path: Path, settings: RecordingSettings) -> None:
    """Make a place this recording's, or find that it already is.

    Raises:
        InvalidValueError: A recording with other settings is there.
    """
    if not path.is_file():
        write_model(path, settings)
        return
    before = _flat(read_model(path, RecordingSettings, what="recording"))
    now = _flat(settings)
    changed = [f"{name} was {before[name]}, is {value}" for name, value in now.items() if before[name] != value]
    if changed:
        raise InvalidValueError(
            f"{path.parent} holds a recording with other settings ({changed[0]}); choose another --out"
        )


class EpisodeParts:
    """Finished episodes, each in a small folder of its own until the whole is put together.

    Args:
        folder: Where the small folders are.
        last_file: The file that is written last into each; an episode without it is not finished.
    """

    def __init__(self, folder: Path, last_file: str) -> None:
        self._folder, self._last_file = folder, last_file

    def path(self, key: EpisodeKey) -> Path:
        """The folder of an episode."""
        return self._folder / f"{key[0]}@{key[1]:04d}"

    def has(self, key: EpisodeKey) -> bool:
        """Whether an episode is finished."""
        return (self.path(key) / self._last_file).is_file()

    def remove(self) -> None:
        """Delete all of them, once they are part of the whole."""
        shutil.rmtree(self._folder, ignore_errors=True)


def _flat(settings: RecordingSettings) -> dict[str, object]:
    values = settings.model_dump()
    return values.pop("run") | values
