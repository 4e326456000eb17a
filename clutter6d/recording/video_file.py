"""A video of each episode, for people: the goal is shown as a green ghost."""

from collections.abc import Iterator
from itertools import chain, repeat
from pathlib import Path

from clutter6d.eval.runner import EpisodeKey
from clutter6d.recording.cameras import CAMERAS
from clutter6d.recording.recording import RecordingSettings, assets_by_hash, claim
from clutter6d.recording.rollout import Rollout
from clutter6d.render.picture import Image, render_rollout
from clutter6d.render.scene_picture import picture_model
from clutter6d.render.video import write_video
from clutter6d.scene import Scene
from clutter6d.sim.scene_model import SceneModel

SETTINGS_FILE = "recording.json"
LAST_FRAME_S = 1.0
"""For so long the end is shown."""


class VideoRecorder:
    """Writes a video of each episode and camera, named by scene, pair and camera.

    Args:
        folder: Where they go; continued if it holds videos of the same settings.
        settings: What the recording depends on.
        ending: ``.mp4`` or ``.gif``.
        backend: Which renderer; see :func:`clutter6d.render.backend.choose_backend`.

    Raises:
        InvalidValueError: The folder holds a recording with other settings.
    """

    def __init__(self, folder: Path, settings: RecordingSettings, ending: str, backend: str = "auto") -> None:
        self._folder, self._settings, self._ending, self._backend = folder, settings, ending, backend
        claim(folder / SETTINGS_FILE, settings)

    def path(self, key: EpisodeKey, camera: str) -> Path:
        """Where the video of an episode is."""
        return self._folder / f"{key[0]}_pair{key[1]}_{camera}{self._ending}"

    def has(self, key: EpisodeKey) -> bool:
        """Whether an episode is recorded already."""
        return all(self.path(key, camera).is_file() for camera in self._settings.cameras)

    def add(self, rollout: Rollout, scene: Scene, model: SceneModel) -> None:
        """Record an episode."""
        shown, settings = picture_model(scene, assets_by_hash(model), rollout.row.pair).model, self._settings
        for camera in settings.cameras:
            size = {"width": settings.width, "height": settings.height}
            frames = render_rollout(shown, rollout.states.qpos(), CAMERAS[camera], **size, backend=self._backend)
            path = self.path(rollout.row.key, camera)
            write_video(_hold_last(frames, round(LAST_FRAME_S * settings.fps)), path, settings.fps)

    def finish(self) -> Path:
        """The folder; each video is complete by itself."""
        return self._folder


def _hold_last(frames: Iterator[Image], count: int) -> Iterator[Image]:
    last: list[Image] = []
    for frame in frames:
        last[:] = [frame]
        yield frame
    yield from chain.from_iterable(repeat(frame, count) for frame in last)
