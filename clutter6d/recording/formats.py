"""The formats of a recording, and what each is like unless told otherwise."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from clutter6d.errors import UnknownNameError
from clutter6d.eval.report import RunSettings
from clutter6d.recording.cameras import SENSORS, find_cameras
from clutter6d.recording.lerobot_features import FPS
from clutter6d.recording.lerobot_recorder import LeRobotRecorder
from clutter6d.recording.recording import Recorder, RecordingSettings
from clutter6d.recording.rollout_file import RolloutRecorder
from clutter6d.recording.source import RecordedEpisodes
from clutter6d.recording.video_file import VideoRecorder

FOLDERS = {"video": "videos", "gif": "gifs", "parquet": "rollouts", "lerobot": "lerobot"}
"""Where each format goes in a recording's folder."""

DEFAULT_CAMERAS = {"video": "episode", "gif": "episode", "lerobot": ",".join(SENSORS)}
DEFAULT_SIZE_PX = {"video": (960, 720), "gif": (480, 360), "lerobot": (320, 240)}
NO_CAMERAS = "none"


def find_formats(names: Sequence[str]) -> tuple[str, ...]:
    """Names of formats, each once.

    Raises:
        UnknownNameError: There is no such format.
    """
    for name in names:
        if name not in FOLDERS:
            raise UnknownNameError("format", name, FOLDERS)
    return tuple(dict.fromkeys(names))


@dataclass(frozen=True, kw_only=True, slots=True)
class RecordingPlan:
    """What is recorded, and how it is drawn.

    Attributes:
        formats: Names of formats.
        cameras: Names of cameras, parted by commas; ``None`` for the format's own, ``"none"`` for a LeRobot data set
            without pictures.
        width: Of the pictures [px]; ``None`` for the format's own.
        height: Of the pictures [px]; ``None`` for the format's own.
        fps: Control steps a second of a video or GIF; LeRobot's videos are in real time.
        backend: Which renderer; see :func:`clutter6d.render.backend.choose_backend`.
        point_clouds: Whether tables and LeRobot data sets hold point clouds.

    Raises:
        UnknownNameError: There is no such camera.
        InvalidValueError: A camera is named twice.
    """

    formats: tuple[str, ...] = ("video",)
    cameras: str | None = None
    width: int | None = None
    height: int | None = None
    fps: int = 20
    backend: str = "auto"
    point_clouds: bool = False

    def __post_init__(self) -> None:
        """Refuse cameras that are not there before anything is run."""
        for name in self.formats:
            self._cameras(name)

    def recorder(self, name: str, out: Path, episodes: RecordedEpisodes) -> Recorder:
        """What writes one format.

        Raises:
            InvalidValueError: The folder holds a recording with other settings, or sizes do not suit.
        """
        folder, settings = out / FOLDERS[name], self._settings(name, episodes.settings)
        if name == "parquet":
            return RolloutRecorder(folder, settings, episodes.keys)
        if name == "lerobot":
            return LeRobotRecorder(folder, settings, episodes.keys, self.backend)
        return VideoRecorder(folder, settings, ".gif" if name == "gif" else ".mp4", self.backend)

    def _settings(self, name: str, run: RunSettings) -> RecordingSettings:
        clouds = self.point_clouds and name in ("parquet", "lerobot")
        cameras = self._cameras(name)
        if not cameras:
            return RecordingSettings(run=run, point_clouds=clouds)
        width, height = DEFAULT_SIZE_PX[name]
        return RecordingSettings(
            run=run,
            point_clouds=clouds,
            cameras=cameras,
            width=self.width or width,
            height=self.height or height,
            fps=FPS if name == "lerobot" else self.fps,
        )

    def _cameras(self, name: str) -> tuple[str, ...]:
        if name not in DEFAULT_CAMERAS or (name == "lerobot" and self.cameras == NO_CAMERAS):
            return ()
        return find_cameras((self.cameras or DEFAULT_CAMERAS[name]).split(","))
