"""Symmetries that a family declares: finite groups by their generators, or a full axis of rotation."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from clutter6d.assets.asset import SymmetryGroup
from clutter6d.geometry import IDENTITY_QUAT, quat_from_axis_angle, quat_multiply

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_SAME = 1e-9


@dataclass(frozen=True, slots=True)
class Symmetry:
    """Rotations about the centre of mass that leave a design's shape unchanged.

    Attributes:
        turns: Generators of the finite group, each an axis and an order: ``("z", 4)`` is a quarter turn.
        continuous: The axis of full rotational symmetry, if there is one.
    """

    turns: tuple[tuple[str, int], ...] = ()
    continuous: str | None = None

    def group(self) -> SymmetryGroup:
        """The whole group; its first rotation is the identity."""
        generators = [quat_from_axis_angle(np.array(AXES[axis]), 2 * np.pi / order) for axis, order in self.turns]
        axis = None if self.continuous is None else AXES[self.continuous]
        return SymmetryGroup(discrete_quats_wxyz=_closure(generators), continuous_axis=axis)


ASYMMETRIC = Symmetry()
HALF_TURN_X, HALF_TURN_Y, HALF_TURN_Z = (Symmetry(((axis, 2),)) for axis in "xyz")
BOX = Symmetry((("z", 2), ("x", 2)))
CUBE = Symmetry((("z", 4), ("x", 4)))
TURNED, TURNED_X = Symmetry(continuous="z"), Symmetry(continuous="x")
SPOOL = Symmetry((("x", 2),), continuous="z")


def prism(sides: int) -> Symmetry:
    """A regular prism's, with both ends alike."""
    return Symmetry((("z", sides), ("x", 2)))


def pyramid(sides: int) -> Symmetry:
    """A regular pyramid's: the two ends differ."""
    return Symmetry((("z", sides),))


def _closure(generators: list[Float64[np.ndarray, "4"]]) -> Float64[np.ndarray, "rotation 4"]:
    group = [np.array(IDENTITY_QUAT)]
    for member in group:
        for generator in generators:
            product = quat_multiply(member, generator)
            if all(abs(float((product * known).sum())) < 1 - _SAME for known in group):
                group.append(product)
    return np.round(np.stack(group), 12) + 0.0
