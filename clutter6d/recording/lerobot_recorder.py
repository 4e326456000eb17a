"""Recording episodes as a LeRobot data set: each episode's frames, videos and statistics, joined at the end."""

from collections.abc import Sequence
from pathlib import Path

from clutter6d.errors import InvalidValueError
from clutter6d.eval.runner import EpisodeKey
from clutter6d.export.licences import licence_table
from clutter6d.recording.cameras import take_pictures
from clutter6d.recording.lerobot_dataset import (
    EPISODE_FILE,
    FRAMES_FILE,
    LICENCES_FILE,
    join_episodes,
    recorded_keys,
)
from clutter6d.recording.lerobot_features import FPS, IMAGE_PREFIX, frame_arrays, frame_table
from clutter6d.recording.lerobot_meta import EpisodeEntry
from clutter6d.recording.lerobot_stats import ColourCounter, FeatureStats, array_stats
from clutter6d.recording.recording import EpisodeParts, RecordingSettings, assets_by_hash, claim
from clutter6d.recording.rollout import Rollout
from clutter6d.recording.rollout_file import SETTINGS_FILE, table_bytes
from clutter6d.render.video import write_video
from clutter6d.scene import Scene
from clutter6d.schema import write_bytes, write_model
from clutter6d.sim.scene_model import SceneModel

KEYFRAME_EVERY = 2
"""Every second picture is a key frame, as LeRobot itself encodes: any picture is found quickly."""


class LeRobotRecorder:
    """Writes a LeRobot data set.

    Args:
        folder: Its root; continued if it holds an unfinished one of the same settings.
        settings: What the recording depends on.
        keys: Scene and pair of all episodes, in order.
        backend: Which renderer; see :func:`clutter6d.render.backend.choose_backend`.

    Raises:
        InvalidValueError: The folder holds a recording with other settings, or pictures have an odd size.
    """

    def __init__(
        self, folder: Path, settings: RecordingSettings, keys: Sequence[EpisodeKey], backend: str = "auto"
    ) -> None:
        if settings.width % 2 or settings.height % 2:
            raise InvalidValueError(f"pictures of {settings.width} x {settings.height}: videos need even sizes")
        self._folder, self._settings, self._keys, self._backend = folder, settings, tuple(keys), backend
        claim(folder / SETTINGS_FILE, settings)
        self._parts = EpisodeParts(folder / ".parts", EPISODE_FILE)
        self._is_complete = recorded_keys(folder) == self._keys

    def has(self, key: EpisodeKey) -> bool:
        """Whether an episode is recorded already."""
        return self._is_complete or self._parts.has(key)

    def add(self, rollout: Rollout, scene: Scene, model: SceneModel) -> None:
        """Record an episode."""
        part, arrays = self._parts.path(rollout.row.key), frame_arrays(rollout)
        stats = {name: array_stats(array) for name, array in arrays.items()} | self._film(part, rollout, model)
        write_bytes(part / FRAMES_FILE, table_bytes(frame_table(arrays)))
        write_bytes(part / LICENCES_FILE, licence_table(scene, assets_by_hash(model)))
        entry = EpisodeEntry(
            scene_id=scene.scene_id,
            pair=rollout.row.pair,
            outcome=rollout.row.outcome,
            task=rollout.task,
            length=len(rollout.actions),
            objects=len(rollout.object_names),
            stats=stats,
        )
        write_model(part / EPISODE_FILE, entry)

    def finish(self) -> Path:
        """Join the episodes."""
        if not self._is_complete:
            join_episodes([self._parts.path(key) for key in self._keys], self._folder, self._settings)
        self._parts.remove()
        return self._folder

    def _film(self, part: Path, rollout: Rollout, model: SceneModel) -> dict[str, FeatureStats]:
        """Write a video for each camera; returns the statistics of the pictures."""
        stats: dict[str, FeatureStats] = {}
        size = {"width": self._settings.width, "height": self._settings.height}
        for camera in self._settings.cameras:
            colours = ColourCounter()
            pictures = take_pictures(rollout, model, camera, **size, backend=self._backend)
            write_video(colours.watch(pictures), part / f"{camera}.mp4", FPS, keyframe_every=KEYFRAME_EVERY)
            stats[IMAGE_PREFIX + camera] = colours.stats()
        return stats
