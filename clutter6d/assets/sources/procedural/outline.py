"""Flat curves: outlines that bodies are lofted through, and the rounding of corners."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

Curve = Float64[np.ndarray, "_point 2"]

Number = int | float
"""A literal coordinate: families write 0 as well as 0.0."""

ROUND_POINTS = 48


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """A convex cross-section of unit radius, counter-clockwise: fine for the eye, coarse for physics."""

    fine: Curve
    coarse: Curve


def circle(points: int, radius: Number = 1.0, phase: Number = 0.5) -> Curve:
    """A regular polygon; ``phase`` in steps, so that by default a flat side looks along -y."""
    angles = 2 * np.pi * (np.arange(points) + phase) / points
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def equal_area_circle(points: int) -> Curve:
    """The regular polygon that has the unit circle's area."""
    return circle(points, np.sqrt(2 * np.pi / (points * np.sin(2 * np.pi / points))))


def round_outline(sides: int = 12, points: int = ROUND_POINTS) -> Outline:
    """The unit circle."""
    return Outline(circle(points), equal_area_circle(sides))


def polygon_outline(sides: int, rounding: Number = 0.08) -> Outline:
    """A regular polygon of unit circumradius with slightly rounded corners."""
    corners = circle(sides)
    return Outline(rounded(corners, rounding, closed=True), corners)


def rectangle_outline(x: Number = 2.0, y: Number = 2.0, rounding: Number = 0.15) -> Outline:
    """A rectangle with rounded corners; of half side 1 by default."""
    corners = np.array([[x, y], [-x, y], [-x, -y], [x, -y]]) / 2
    return Outline(rounded(corners, rounding, closed=True), corners)


def rounded(
    corners: Sequence[Sequence[Number]] | Float64[np.ndarray, "_corner _axis"],
    radius: Number | Sequence[Number],
    *,
    closed: bool = False,
    steps: int = 3,
) -> Float64[np.ndarray, "_point _axis"]:
    """A polyline whose corners are replaced by parabolic arcs.

    Args:
        corners: The control points.
        radius: How far along each side an arc begins at most; half a side is the limit, which a large radius reaches,
            and then the curve is a quadratic B-spline. One for all corners, or one for each.
        closed: Whether the last point joins the first.
        steps: Segments of each arc.
    """
    points = np.asarray(corners, dtype=float)
    radii = np.broadcast_to(np.asarray(radius, dtype=float), len(points))
    before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
    result: list[np.ndarray] = []
    for i, (a, b, c) in enumerate(zip(before, points, after, strict=True)):
        if not closed and i in (0, len(points) - 1):
            result.append(b[None])
            continue
        lengths = [np.sqrt(((end - b) ** 2).sum()) for end in (a, c)]
        start, end = (b + (p - b) * min(radii[i] / max(n, 1e-12), 0.5) for p, n in zip((a, c), lengths, strict=True))
        t = np.linspace(0, 1, steps + 1)[:, None]
        result.append((1 - t) ** 2 * start + 2 * t * (1 - t) * b + t**2 * end)
    curve = np.concatenate(result)
    apart = np.sqrt(((curve - np.roll(curve, 1, axis=0)) ** 2).sum(axis=1)) > 1e-6
    apart[0] = apart[0] if closed else True
    return curve[apart]


def simplified(
    corners: Sequence[Sequence[Number]] | Float64[np.ndarray, "_corner _axis"], radius: Number
) -> Float64[np.ndarray, "_corner _axis"]:
    """As many points as there are corners, each on the rounded polyline: the ends, and the middle of every arc."""
    points = np.asarray(corners, dtype=float)
    middles = [rounded(points[i : i + 3], radius, steps=2)[1:-1] for i in range(len(points) - 2)]
    return np.stack([points[0], *(arc[len(arc) // 2] for arc in middles), points[-1]])
