"""What a person does with a playlist: play, pause, step, go back, choose; nothing here knows how it is shown."""

from dataclasses import dataclass

import mujoco

from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.eval.episode import EpisodeRow
from clutter6d.eval.runner import HOLD_STEPS, EpisodeKey, EpisodeRunner
from clutter6d.play.live_episode import Frame, LiveEpisode
from clutter6d.play.playlist import Playlist
from clutter6d.scene import Scene

SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class Selection:
    """The episode that is chosen, and how many there are."""

    scene_id: str
    pair: int
    number: int
    count: int


class PlaySession:
    """One playlist, one episode of it at a time; every frame that was simulated can be gone back to.

    Args:
        playlist: What is played.
        start: Scene and pair to begin with; by default the first.

    Attributes:
        playlist: What is played.
        is_playing: Whether time runs.
        speed: Simulated seconds a second.

    Raises:
        UnknownNameError: There is no such scene.
        InvalidValueError: There is no such pair, or the policy failed.
    """

    def __init__(self, playlist: Playlist, start: EpisodeKey | None = None) -> None:
        self.playlist = playlist
        self.is_playing = False
        self.speed = 1.0
        self._runner = EpisodeRunner(
            playlist.scenes, playlist.policy, config=playlist.config, seed=playlist.seed, num_envs=1, threads=1
        )
        self._scenes = {scene.scene_id: scene for scene in playlist.scenes.scenes}
        self._number = playlist.keys.index(self._known(start)) if start else 0
        self._begin()

    @property
    def selection(self) -> Selection:
        """Which episode this is."""
        scene_id, pair = self.playlist.keys[self._number]
        return Selection(scene_id=scene_id, pair=pair, number=self._number, count=len(self.playlist.keys))

    @property
    def scene(self) -> Scene:
        """The scene of the episode."""
        return self._scenes[self.selection.scene_id]

    @property
    def model(self) -> mujoco.MjModel:
        """The scene as it is simulated."""
        return self._episode.model

    @property
    def recorded_row(self) -> EpisodeRow | None:
        """What came of the episode when it was recorded, if it was."""
        return self.playlist.rows.get(self.playlist.keys[self._number])

    @property
    def frame(self) -> Frame:
        """What is to be seen now."""
        return self._frames[self._index]

    @property
    def last_step(self) -> int:
        """The last step that :meth:`seek` can go to: of a recorded episode its end, else the last one simulated."""
        row = self.recorded_row
        recorded = row.steps + HOLD_STEPS * row.is_success if row else 0
        return max(recorded, len(self._frames) - 1)

    @property
    def is_over(self) -> bool:
        """Whether the episode has ended and its end is shown."""
        return self._episode.record is not None and self._index == len(self._frames) - 1

    def step(self, count: int = 1) -> None:
        """Go on by control steps, simulating what has not been; at the end nothing happens, and time stops.

        Raises:
            InvalidValueError: The policy failed.
        """
        for _ in range(count):
            if self._index == len(self._frames) - 1:
                if self._episode.record is not None:
                    break
                self._frames.append(self._episode.advance())
            self._index += 1
        self.is_playing = self.is_playing and not self.is_over

    def step_back(self) -> None:
        """Stop, and go back by one control step; at the start nothing happens."""
        self.is_playing = False
        self._index = max(self._index - 1, 0)

    def seek(self, step: int) -> None:
        """Go to a step, from 0 to :attr:`last_step` at most."""
        wanted = min(max(step, 0), self.last_step)
        self._index = min(wanted, len(self._frames) - 1)
        self.step(wanted - self._index)

    def toggle(self) -> None:
        """Let time run or stop; at the end of an episode, play it again."""
        if self.is_over:
            self._index = 0
        self.is_playing = not self.is_playing

    def restart(self) -> None:
        """Go to the start of the episode and forget what was simulated of it."""
        self._begin()

    def go(self, by: int) -> None:
        """Go on to another episode of the list, or back if ``by`` is negative; round at the ends."""
        self._number = (self._number + by) % len(self.playlist.keys)
        self._begin()

    def select(self, scene_id: str, pair: int | None = None) -> None:
        """Go to an episode.

        Args:
            scene_id: The scene.
            pair: The goal pair; by default the scene's first in the list.

        Raises:
            UnknownNameError: No episode has that scene.
            InvalidValueError: No episode has that pair.
        """
        pairs = [number for name, number in self.playlist.keys if name == scene_id]
        key = self._known((scene_id, pairs[0] if pair is None and pairs else pair or 0))
        self._number = self.playlist.keys.index(key)
        self._begin()

    def pairs(self) -> tuple[int, ...]:
        """Goal pairs of the scene that are in the list."""
        scene_id = self.selection.scene_id
        return tuple(pair for name, pair in self.playlist.keys if name == scene_id)

    def _known(self, key: EpisodeKey) -> EpisodeKey:
        if key[0] not in self.playlist.scene_ids:
            raise UnknownNameError("scene", key[0], self.playlist.scene_ids)
        pairs = [pair for name, pair in self.playlist.keys if name == key[0]]
        if key[1] not in pairs:
            raise InvalidValueError(f"scene {key[0]} is played with goal pairs {_ranges(pairs)}, not {key[1]}")
        return key

    def _begin(self) -> None:
        self._episode = LiveEpisode(self._runner, self.playlist.keys[self._number])
        self._frames, self._index = [self._episode.frame], 0


def _ranges(pairs: list[int]) -> str:
    return f"{min(pairs)} to {max(pairs)}" if len(pairs) > 1 else str(pairs[0])
