"""Playlists and windows for the tests of playing."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import TerminationConfig
from clutter6d.play.live_view import Action
from clutter6d.play.playlist import Playlist, live_playlist
from tests.eval.scripted import ScriptedPolicy, scenes_with_known_outcomes

STEPS = 12
"""Control steps after which an episode ends."""


def make_playlist(policy=None) -> Playlist:
    """Episodes with known outcomes: of every scene, pair 0 succeeds at once and pair 1 drops an object."""
    live = live_playlist(scenes_with_known_outcomes(), policy or ScriptedPolicy())
    config = EnvConfig(termination=TerminationConfig(max_steps=STEPS))
    return Playlist(scenes=live.scenes, keys=live.keys, policy=live.policy, title=live.title, config=config)


@dataclass
class PaperView:
    """A window that writes down what it is told, and asks for what the test puts into ``asked``."""

    is_open: bool = True
    is_watched: bool = False
    asked: list[str] = field(default_factory=list)
    offered: tuple[Action, ...] = ()
    shown: list[tuple[str, int]] = field(default_factory=list)
    qpos: list[np.ndarray] = field(default_factory=list)
    points: int = 0
    text: str = ""

    def offer(self, actions: Sequence[Action]) -> None:
        self.offered = tuple(actions)

    def triggered(self) -> tuple[str, ...]:
        asked, self.asked = tuple(self.asked), []
        return asked

    def show(self, scene, assets, pair=0) -> None:
        self.shown.append((scene.scene_id, pair))

    def update(self, qpos) -> None:
        self.qpos.append(qpos)

    def draw_points(self, points, rgb) -> None:
        assert points.shape == rgb.shape
        self.points = len(points)

    def message(self, text: str) -> None:
        self.text = text

    def close(self) -> None:
        self.is_open = False
