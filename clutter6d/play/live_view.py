"""A window on a scene that moves: what the page in a browser and MuJoCo's viewer have in common.

Whoever simulates calls :meth:`LiveView.show` when the scene changes, :meth:`LiveView.update` after every control step,
and asks :meth:`LiveView.triggered` what the person wants; nothing is called back from another thread.
"""

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float32, Float64, UInt8

from clutter6d.assets.asset import Asset
from clutter6d.scene import Scene

Item = TypeVar("Item")


@dataclass(frozen=True, kw_only=True, slots=True)
class Action:
    """Something that a person can ask for, by a key and, in a browser, by a button.

    Attributes:
        name: What :meth:`LiveView.triggered` gives.
        label: On the button, and in the list of keys.
        key: ``"A"`` to ``"Z"``, ``"0"`` to ``"9"``, ``"space"``, ``"enter"``, ``"backspace"``, ``"home"``, ``"end"``,
            ``"pageup"``, ``"pagedown"``, ``"arrowleft"``, ``"arrowright"``, ``"arrowup"`` or ``"arrowdown"``. In a
            browser, W A S D Q E and the arrows move the camera as well; a held key repeats after half a second.
        has_button: Whether a browser shows a button for it.
    """

    name: str
    label: str
    key: str
    has_button: bool = True


@runtime_checkable
class LiveView(Protocol):
    """A window on one scene at a time."""

    @property
    def is_open(self) -> bool:
        """Whether the window is still there; a page can be left and opened again, so its view stays open."""
        ...

    @property
    def is_watched(self) -> bool:
        """Whether anyone looks at it."""
        ...

    def offer(self, actions: Sequence[Action]) -> None:
        """Let the person ask for these; called once, before anything is shown."""
        ...

    def triggered(self) -> tuple[str, ...]:
        """Names of the actions asked for since the last call, in order."""
        ...

    def show(self, scene: Scene, assets: Mapping[str, Asset], pair: int = 0) -> None:
        """Show another scene, or another goal pair of it, at its start.

        Args:
            scene: The scene.
            assets: Its assets by content hash.
            pair: Index of the goal pair.
        """
        ...

    def update(self, qpos: Float64[np.ndarray, "nq"]) -> None:
        """Move everything to a configuration, laid out as the simulator's."""
        ...

    def draw_points(self, points: Float32[np.ndarray, "point 3"], rgb: UInt8[np.ndarray, "point 3"]) -> None:
        """Draw points [m, world frame] in their colours, instead of those drawn before; none to draw nothing."""
        ...

    def message(self, text: str) -> None:
        """Show some lines of plain text beside the scene; a tab parts a label from its value."""
        ...

    def close(self) -> None:
        """Close the window; more than once is no error."""
        ...


def drain(queue: SimpleQueue[Item]) -> tuple[Item, ...]:
    """Everything that is in a queue, which another thread fills."""
    items: list[Item] = []
    while True:
        try:
            items.append(queue.get_nowait())
        except Empty:
            return tuple(items)


def has_display() -> bool:
    """Whether a window can be opened, as far as the environment tells."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
