"""The person with a device in hand: when time goes on, and what the arm shall do."""

from collections.abc import Iterable, Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32, Float64

from clutter6d.envs.action import ActionConfig
from clutter6d.errors import Clutter6DError
from clutter6d.play.live_view import Action, LiveView
from dapl_baselines.teleop.device import Command, DeviceLostError, TeleopDevice, Wish
from dapl_baselines.teleop.gello import misalignment
from dapl_baselines.teleop.keyboard import MOVES, SPEEDS
from dapl_baselines.teleop.motion import MotionConfig, Steering, still
from dapl_baselines.teleop.status import Phase

RECONNECT_EVERY = 10
"""Control steps between attempts to reach a device that was lost."""
WISH_KEYS: dict[str, Wish] = {"enter": "toggle", "space": "toggle", "backspace": "give_up", "x": "quit"}
BUTTONS = (
    Action(name="enter", label="Start, pause, go on", key="enter"),
    Action(name="backspace", label="Give up (twice)", key="backspace"),
    Action(name="x", label="Leave", key="X"),
)
"""What a viewer offers; named by the key of the terminal that does the same."""


class OperatorLeftError(Clutter6DError):
    """The person left; everything is kept, and the same command goes on."""


@runtime_checkable
class KeySource(Protocol):
    """Where keys are pressed."""

    @property
    def is_closed(self) -> bool:
        """Whether no more will come."""
        ...

    def keys(self) -> tuple[str, ...]:
        """Keys pressed since the last call."""
        ...


def offered_actions(device: TeleopDevice) -> tuple[Action, ...]:
    """What a viewer lets the person ask for: the buttons, and with a keyboard as device the keys it is driven by."""
    keys = (*MOVES, *SPEEDS) if device.name == "keyboard" else ()
    hidden = (Action(name=key, label=f"drive: {key}", key=key.upper(), has_button=False) for key in keys)
    return (*BUTTONS, *hidden)


class Operator:
    """Drives, pauses, gives up and leaves; a device that is lost pauses.

    Args:
        device: What the person holds; connected.
        keys: The terminal.
        view: Where the scene is shown, or ``None``.
        action: The benchmark's action mapping.
        motion: What full deflection means.

    Attributes:
        phase: Whether time goes on.
        note: What the person should know.
        has_given_up: Whether this attempt was given up.
    """

    def __init__(
        self, device: TeleopDevice, keys: KeySource, view: LiveView | None, action: ActionConfig, motion: MotionConfig
    ) -> None:
        self._device, self._keys, self._view = device, keys, view
        self._steering = Steering(action, motion)
        self._is_lost, self._ticks = False, 0
        self.await_start()

    def await_start(self, note: str = "") -> None:
        """Another attempt, or one that was left: time stands still until the person starts."""
        self.phase: Phase = "ready"
        self.note = self._lost_note if self._is_lost else note
        self.has_given_up = self._was_asked = False
        self._steering.forget()

    def listen(self, arm_qpos: Float64[np.ndarray, "7"]) -> Float32[np.ndarray, "7"] | None:
        """What the arm shall do in this control step, or ``None`` while time stands still.

        Args:
            arm_qpos: Current joint angles [rad].

        Raises:
            OperatorLeftError: The person leaves.
        """
        was_driving, keys = self.phase == "driving", self._pressed()
        try:
            command = self._read(keys)
            for wish in (*_wishes_of(keys), *command.wishes):
                self._obey(wish, command, arm_qpos)
            return self._steering.residuals(command, arm_qpos) if self.phase == "driving" else None
        except DeviceLostError as error:
            self._lose(str(error))
        for wish in _wishes_of(keys):
            self._obey(wish, Command(), arm_qpos)
        return still() if was_driving else None

    def _pressed(self) -> tuple[str, ...]:
        if self._keys.is_closed or (self._view is not None and not self._view.is_open):
            raise OperatorLeftError("the window was closed")
        return (*self._keys.keys(), *(self._view.triggered() if self._view else ()))

    def _read(self, keys: Sequence[str]) -> Command:
        """What the device says; one that was lost is tried again now and then."""
        if self._is_lost:
            self._ticks += 1
            if self._ticks % RECONNECT_EVERY:
                raise DeviceLostError(self._lost_note)
            self._device.connect()
            self._is_lost, self.note = False, f"the {self._device.name} is back"
        return self._device.read(keys)

    def _lose(self, why: str) -> None:
        """The device cannot be read: time stands still until it is back and the person goes on."""
        self._is_lost, self._lost_note = True, why
        self.note = why
        if self.phase == "driving":
            self.phase = "paused"

    def _obey(self, wish: Wish, command: Command, arm_qpos: Float64[np.ndarray, "7"]) -> None:
        if wish == "quit":
            raise OperatorLeftError("left by the person")
        if wish == "give_up":
            self._give_up()
            return
        self._was_asked = False
        if self.phase == "driving":
            self.phase, self.note = "paused", ""
        elif not self._is_lost:
            self.note = (misalignment(command.joints, arm_qpos) if command.joints is not None else None) or ""
            self.phase = self.phase if self.note else "driving"

    def _give_up(self) -> None:
        """Pause and ask at the first time, give up at the second."""
        self.has_given_up = self._was_asked
        if not self._was_asked:
            self._was_asked, self.note = True, "give up? once more; Enter goes on"
            self.phase = "paused" if self.phase == "driving" else self.phase


def _wishes_of(keys: Iterable[str]) -> tuple[Wish, ...]:
    return tuple(WISH_KEYS[key] for key in keys if key in WISH_KEYS)
