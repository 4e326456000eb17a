"""People and devices that do what a script says, one entry a control step."""

import numpy as np

from clutter6d.sim.robot import HOME_QPOS
from dapl_baselines.teleop.device import Command, DeviceLostError
from dapl_baselines.teleop.pace import Pace

PUSH = np.array([0.5, 0.2, -0.4, 0.0, 0.1, 0.3])


class Person:
    """Presses keys: at each step those of the script's next entry; leaves when the script is over."""

    def __init__(self, *script: str) -> None:
        self._script = [entry.split() for entry in script]

    @property
    def is_closed(self) -> bool:
        return not self._script

    def keys(self) -> tuple[str, ...]:
        return tuple(self._script.pop(0))


class Lever:
    """A device that pushes as far as it is told, and is lost when it is told so."""

    name = "lever"
    help_lines = ("lever\tpushes",)

    def __init__(self, deflection=PUSH) -> None:
        self.deflection = deflection
        self.settings = {"strength": 1}
        self.is_lost = False
        self.reads = self.connections = 0

    def connect(self) -> None:
        self.connections += 1
        if self.is_lost:
            raise DeviceLostError("the lever is gone")

    def read(self, keys) -> Command:
        self.reads += 1
        if "0" in keys:
            self.is_lost = True
        if "9" in keys:
            self.is_lost = False
        if self.is_lost:
            raise DeviceLostError("the lever is gone")
        return Command(deflection=self.deflection)

    def close(self) -> None:
        pass


class Arm(Lever):
    """A device with joints, like a GELLO."""

    def __init__(self, joints=HOME_QPOS) -> None:
        super().__init__()
        self.joints = joints

    def read(self, keys) -> Command:
        super().read(keys)
        return Command(joints=self.joints)


class Window:
    """A view that remembers what it was shown."""

    is_open = is_watched = True

    def __init__(self) -> None:
        self.offered: list[str] = []
        self.shown: list[tuple[str, int]] = []
        self.asked: list[str] = []
        self.frames = 0
        self.text = ""

    def offer(self, actions) -> None:
        self.offered += [action.name for action in actions]

    def triggered(self) -> tuple[str, ...]:
        asked, self.asked = tuple(self.asked), []
        return asked

    def show(self, scene, assets, pair=0) -> None:
        assert {item.asset_hash for item in scene.objects} <= set(assets)
        self.shown.append((scene.scene_id, pair))

    def update(self, qpos) -> None:
        assert qpos.shape == (7 + 7 * 4,)
        self.frames += 1

    def draw_points(self, points, rgb) -> None:
        pass

    def message(self, text) -> None:
        self.text = text

    def close(self) -> None:
        self.is_open = False


def no_wait() -> Pace:
    """A clock by which every step is due."""
    return Pace(lambda: 0.0, lambda seconds: None)
