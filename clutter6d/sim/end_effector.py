"""The end effector's shape: the hand's box and the two closed fingers, and canonical points on its surface.

All in the hand's frame: z along the fingers, y across them.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Bool, Float32, Float64

from clutter6d.seeding import generator
from clutter6d.sim.robot_facts import TIP_OFFSET_M

END_EFFECTOR_POINTS = 256


@dataclass(frozen=True, kw_only=True, slots=True)
class Box:
    """An axis-aligned box."""

    centre_m: tuple[float, float, float]
    half_m: tuple[float, float, float]

    def area(self) -> float:
        """Surface area [m^2]."""
        x, y, z = self.half_m
        return 8 * (x * y + y * z + z * x)

    def sample(self, rng: np.random.Generator, count: int) -> Float64[np.ndarray, "point 3"]:
        """Points uniformly on the surface."""
        x, y, z = self.half_m
        faces = np.array([y * z, z * x, x * y])
        axis = rng.choice(3, size=count, p=faces / faces.sum())
        unit = rng.uniform(-1, 1, size=(count, 3))
        unit[np.arange(count), axis] = rng.choice([-1.0, 1.0], size=count)
        return unit * self.half_m + self.centre_m

    def contains(self, points: Float64[np.ndarray, "point 3"]) -> Bool[np.ndarray, "point"]:
        """Which points lie strictly inside."""
        return np.all(np.abs(points - self.centre_m) < np.array(self.half_m) - 1e-9, axis=-1)


@dataclass(frozen=True, kw_only=True, slots=True)
class UprightCapsule:
    """A capsule along z."""

    centre_m: tuple[float, float, float]
    radius_m: float
    half_length_m: float

    def area(self) -> float:
        """Surface area [m^2]."""
        return 4 * np.pi * self.radius_m * (self.half_length_m + self.radius_m)

    def sample(self, rng: np.random.Generator, count: int) -> Float64[np.ndarray, "point 3"]:
        """Points uniformly on the surface.

        By Archimedes' theorem equal heights of a sphere carry equal areas, as those of a cylinder do.
        """
        reach = self.half_length_m + self.radius_m
        angle, height = rng.uniform(0, 2 * np.pi, size=count), rng.uniform(-reach, reach, size=count)
        overhang = np.maximum(np.abs(height) - self.half_length_m, 0)
        around = np.sqrt(self.radius_m**2 - overhang**2)
        return np.stack([around * np.cos(angle), around * np.sin(angle), height], axis=-1) + self.centre_m

    def contains(self, points: Float64[np.ndarray, "point 3"]) -> Bool[np.ndarray, "point"]:
        """Which points lie strictly inside."""
        local = points - self.centre_m
        local[:, 2] = np.maximum(np.abs(local[:, 2]) - self.half_length_m, 0)
        return (local**2).sum(axis=-1) < (self.radius_m - 1e-9) ** 2


HAND_BOX = Box(centre_m=(0.0, 0.0, 0.033), half_m=(0.0316, 0.1023, 0.0330))

_FINGER_RADIUS_M, _FINGER_BOTTOM_M = 0.0095, 0.055


def _finger(side: int) -> UprightCapsule:
    half = (TIP_OFFSET_M - _FINGER_BOTTOM_M) / 2
    return UprightCapsule(
        centre_m=(0.0, side * 0.0085, TIP_OFFSET_M - half),
        radius_m=_FINGER_RADIUS_M,
        half_length_m=half - _FINGER_RADIUS_M,
    )


FINGERS = (_finger(1), _finger(-1))
"""The left finger (positive y) and the right one."""


def is_in_end_effector(points: Float64[np.ndarray, "point 3"]) -> Bool[np.ndarray, "point"]:
    """Which points lie in the hand or in a closed finger.

    Args:
        points: In the hand's frame [m].
    """
    return np.any([shape.contains(points) for shape in (HAND_BOX, *FINGERS)], axis=0)


@cache
def end_effector_points() -> Float32[np.ndarray, "256 3"]:
    """Canonical points, uniform on the outer surface of the hand and its closed fingers, in the hand's frame [m].

    Always the same points (paper, Table "Summary of our MDP components": end-effector points). Read-only.
    """
    shapes = (HAND_BOX, *FINGERS)
    areas = np.array([shape.area() for shape in shapes])
    rng = generator(0, "end_effector_points")
    counts = rng.multinomial(4 * END_EFFECTOR_POINTS, areas / areas.sum())
    outer: list[np.ndarray] = []
    for shape, count in zip(shapes, counts, strict=True):
        points = shape.sample(rng, int(count))
        hidden = [other.contains(points) for other in shapes if other is not shape]
        outer.append(points[~np.any(hidden, axis=0)])
    points = np.concatenate(outer)[rng.permutation(sum(map(len, outer)))[:END_EFFECTOR_POINTS]].astype(np.float32)
    points.flags.writeable = False
    return points
