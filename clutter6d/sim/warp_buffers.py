"""Room for contacts and constraints on the device, and the watch for its overflow.

MuJoCo Warp allocates both once. Contacts of all worlds share one buffer; pairs of geoms that come near take a place in
it too. Constraints have a buffer for each world. What does not fit is left out of the simulation.
"""

import logging
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from clutter6d.errors import InvalidValueError
from clutter6d.sim.warp_runtime import mujoco_warp, warp

_log = logging.getLogger(__name__)
_KINDS = mujoco_warp.OverflowType
_CONTACTS = _KINDS.BROADPHASE | _KINDS.NARROWPHASE | _KINDS.CCD
_CONSTRAINTS = _KINDS.NEFC | _KINDS.NJMAX_NNZ
_OTHER = _KINDS.EPA_HORIZON


@dataclass(frozen=True, kw_only=True, slots=True)
class BufferSizes:
    """Room for each world.

    Attributes:
        contacts: Contacts and near pairs of geoms, on average over all worlds.
        constraints: Rows of constraints: 4 for a contact, 1 for a joint at its limit.
    """

    contacts: int
    constraints: int

    def __post_init__(self) -> None:
        """Refuse sizes that hold nothing."""
        if self.contacts < 1 or self.constraints < 1:
            raise InvalidValueError(
                f"buffer sizes {self.contacts} and {self.constraints}: both must be 1 or more for each world"
            )


def allocate_data(model: mujoco.MjModel, worlds: int, sizes: BufferSizes) -> Any:
    """The worlds' data on the current device; half as many searches for a contact's depth as there may be contacts."""
    contacts = sizes.contacts * worlds
    searches = max(1, contacts // 2)
    return mujoco_warp.make_data(model, nworld=worlds, naconmax=contacts, naccdmax=searches, njmax=sizes.constraints)


def default_sizes(object_count: int) -> BufferSizes:
    """Room for scenes of so many objects (``docs/gpu.md`` has the measurements)."""
    return BufferSizes(contacts=64 + 16 * object_count, constraints=256 + 64 * object_count)


class OverflowWatch:
    """Looks for overflow after each control step and logs once what to raise.

    Args:
        data: The worlds' data.
        sizes: The room they have.
        worlds: Number of worlds.

    Attributes:
        overflows: Control steps in which something did not fit in some world.
    """

    def __init__(self, data: Any, sizes: BufferSizes, worlds: int) -> None:
        self._data, self._sizes, self._worlds = data, sizes, worlds
        self._flags = warp.to_torch(data.overflow)
        self._said: set[str] = set()
        self.overflows = 0

    def look(self) -> None:
        """Read and clear the device's flags; waits for the device."""
        flagged = (self._flags & int(_CONTACTS | _CONSTRAINTS | _OTHER)) != 0
        worlds = int(flagged.sum())
        if not worlds:
            return
        self.overflows += 1
        bits = np.bitwise_or.reduce(self._flags.cpu().numpy())
        self._flags.zero_()
        self._report(int(bits), worlds)

    def _report(self, bits: int, worlds: int) -> None:
        if bits & int(_CONTACTS):
            used = max(int(self._data.nacon.numpy()[0]), int(self._data.ncollision.numpy()[0]))
            self._say("contacts", worlds, self._sizes.contacts, -(-used // self._worlds))
        if bits & int(_CONSTRAINTS):
            self._say("constraints", worlds, self._sizes.constraints, int(self._data.nefc.numpy().max()))
        if bits & int(_OTHER) and "depth" not in self._said:
            self._said.add("depth")
            _log.warning("a contact's depth was found only roughly in %d worlds (its search ran out of room)", worlds)

    def _say(self, what: str, worlds: int, size: int, used: int) -> None:
        if what in self._said:
            return
        self._said.add(what)
        _log.warning(
            "%s did not fit in %d worlds and were left out of the simulation: raise BufferSizes.%s from %d to %d",
            what,
            worlds,
            what,
            size,
            max(2 * size, used),
        )
