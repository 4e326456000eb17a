"""Primitive solids: slabs and boxes, turned bodies, cups, rings and swept bars. All else is composed of these."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float64

from clutter6d.assets.sources.procedural.outline import (
    ROUND_POINTS,
    Curve,
    Number,
    Outline,
    circle,
    equal_area_circle,
    rectangle_outline,
    round_outline,
    rounded,
    simplified,
)
from clutter6d.assets.sources.procedural.solid import Points, Solid, loft, weld

MAX_PART_VERTICES = 32
MIN_SIDES, MAX_SIDES = 8, 14

Profile = Sequence[tuple[Number, Number]]
"""Points (radius, z) from the bottom up."""

ROUND = round_outline()
SQUARE = rectangle_outline()


def ring_at(outline: Curve, radius: Number, z: Number) -> Points:
    """An outline of some radius at some height; a single point where the radius is zero."""
    if radius <= 0:
        return np.array([[0.0, 0.0, z]])
    return np.column_stack([outline * radius, np.full(len(outline), z)])


def slab(corners: Sequence[tuple[Number, Number]] | Curve, height: Number, *, rounding: Number = 0.002) -> Solid:
    """A flat convex body: corners counter-clockwise, edges rounded for the eye."""
    outline = np.asarray(corners, dtype=float)
    fine, centre = rounded(outline, rounding, closed=True), outline.mean(axis=0)
    bevel = min(rounding / 2, height / 4)
    inset = centre + (fine - centre) * (1 - bevel / np.abs(outline - centre).max(axis=0))
    levels = [(inset, 0.0), (fine, bevel), (fine, height - bevel), (inset, height)]
    rings = [np.column_stack([curve, np.full(len(curve), z)]) for curve, z in levels]
    ends = [np.column_stack([outline, np.full(len(outline), z)]) for z in (0.0, height)]
    return Solid((loft(rings),), (np.concatenate(ends),))


def box(x: Number, y: Number, z: Number, *, rounding: Number = 0.003) -> Solid:
    """A cuboid with rounded edges."""
    return slab([(x / 2, y / 2), (-x / 2, y / 2), (-x / 2, -y / 2), (x / 2, -y / 2)], z, rounding=rounding)


def disc(radius: Number, height: Number, *, rounding: Number = 0.002, outline: Outline = ROUND) -> Solid:
    """A cylinder."""
    return lathe([(radius, 0.0), (radius, height)], rounding=rounding, outline=outline)


def lathe(profile: Profile, *, rounding: Number = 0.002, edge: Number | None = None, outline: Outline = ROUND) -> Solid:
    """A solid turned body; one convex part for each convex run of the profile.

    Args:
        profile: Radii and heights; a horizontal step is two points of one height.
        rounding: How far corners are rounded for the eye; large values make smooth curves of the profile.
        edge: The same for the edges of the foot and the top; as ``rounding`` if ``None``.
        outline: The cross-section.
    """
    (_, bottom), (_, top) = profile[0], profile[-1]
    radii = [rounding] * (len(profile) + 2)
    radii[1] = radii[-2] = rounding if edge is None else edge
    curve = rounded([(0.0, bottom), *profile, (0.0, top)], radii)
    shell = loft([ring_at(outline.fine, radius, z) for radius, z in curve])
    felt = [(float(radius), float(z)) for radius, z in simplified(profile, rounding)]
    return Solid((shell,), tuple(_turned_part(run, outline) for run in convex_runs(felt)))


def convex_runs(profile: Profile) -> list[list[tuple[Number, Number]]]:
    """The profile cut into runs whose turned bodies are convex and small enough for one part."""
    runs: list[list[tuple[Number, Number]]] = [[profile[0]]]
    for radius, z in profile[1:]:
        run = runs[-1]
        if z - run[-1][1] < 1e-9:
            runs.append([(radius, z)])
            continue
        if len(run) >= 2:
            (r0, z0), (r1, z1) = run[-2:]
            is_reflex = (r1 - r0) * (z - z1) < (radius - r1) * (z1 - z0) - 1e-12
            if is_reflex or len(run) * MIN_SIDES >= MAX_PART_VERTICES:
                runs.append([run[-1]])
        runs[-1].append((radius, z))
    return [run for run in runs if len(run) > 1]


def _turned_part(run: Profile, outline: Outline) -> Points:
    coarse = outline.coarse
    if outline is ROUND:
        coarse = equal_area_circle(min(MAX_SIDES, MAX_PART_VERTICES // len(run)))
    return np.concatenate([ring_at(coarse, radius, z) for radius, z in run])


def cup(
    outer: Profile,
    *,
    wall: Number,
    floor: Number,
    sectors: int = 10,
    rounding: Number = 0.002,
    outline: Outline | None = None,
) -> Solid:
    """An open vessel: a floor and a wall of convex sectors.

    Args:
        outer: The outer profile, straight or bulging outwards.
        wall: Thickness of the wall, measured horizontally.
        floor: Thickness of the floor.
        sectors: Wall segments of a round vessel; otherwise one for each side of the outline.
        rounding: How far the rim's and the foot's corners are rounded for the eye.
        outline: The cross-section; round if ``None``.
    """
    section = outline or round_outline(sectors)
    radius = np.interp(floor, [z for _, z in outer], [r for r, _ in outer])
    top_radius, top = outer[-1]
    inner = [(top_radius - wall, top), (float(radius) - wall, floor)]
    curve = rounded([(0.0, outer[0][1]), *outer, *inner, (0.0, floor)], rounding)
    shell = loft([ring_at(section.fine, r, z) for r, z in curve])
    base = np.concatenate([ring_at(section.coarse, *outer[0]), ring_at(section.coarse, inner[1][0], floor)])
    ends = zip(section.coarse, np.roll(section.coarse, -1, axis=0), strict=True)
    walls = [np.concatenate([ring_at(np.stack(side), r, z) for r, z in [*outer, *inner]]) for side in ends]
    return Solid((shell,), (base, *walls))


def ring(outer: Number, inner: Number, height: Number, *, sectors: int = 8, outline: Outline | None = None) -> Solid:
    """A body with a round hole through it, along z: a washer, a nut, a short tube."""
    section = outline or round_outline(sectors)
    fine = section.fine if outline is None else _resampled(section.coarse, ROUND_POINTS)
    count = len(section.coarse)
    hole, coarse_hole = _directions(fine) * inner, equal_area_circle(count) * inner
    levels = [(fine * outer, 0.0), (fine * outer, height), (hole, height), (hole, 0.0)]
    shell = loft([np.column_stack([curve, np.full(len(curve), z)]) for curve, z in levels], closed=True)
    parts: list[Points] = []
    for i in range(count):
        j = (i + 1) % count
        flat = np.stack([section.coarse[i] * outer, section.coarse[j] * outer, coarse_hole[i], coarse_hole[j]])
        parts.append(np.concatenate([np.column_stack([flat, np.full(4, z)]) for z in (0.0, height)]))
    return Solid((shell,), tuple(parts))


def _directions(curve: Curve) -> Curve:
    return curve / np.sqrt((curve * curve).sum(axis=1, keepdims=True))


def _resampled(corners: Curve, points: int) -> Curve:
    """The polygon's points in the directions of a circle's, so that both can be lofted."""
    sides = len(corners)
    share = np.arange(points) * sides / points
    index = share.astype(int) % sides
    part = (share % 1.0)[:, None]
    return corners[index] * (1 - part) + corners[(index + 1) % sides] * part


def bar(
    path: Sequence[Sequence[Number]],
    width: Number | Sequence[Number],
    thickness: Number | Sequence[Number] | None = None,
    *,
    side: Sequence[Number] = (0.0, 1.0, 0.0),
    square: bool = False,
    rounding: Number = 1.0,
) -> Solid:
    """A bar swept along a plane path: handles, spouts, rods, cutlery.

    Args:
        path: Control points, in a plane.
        width: Full size along ``side``, one for all or one for each point.
        thickness: Full size in the path's plane; as the width if ``None``.
        side: The path plane's normal.
        square: Whether the cross-section is a rounded rectangle instead of an ellipse.
        rounding: How far the path's corners are rounded for the eye; by default into one smooth curve.
    """
    points = np.asarray(path, dtype=float)
    wide = np.broadcast_to(np.asarray(width, dtype=float), len(points))
    thick = wide if thickness is None else np.broadcast_to(np.asarray(thickness, dtype=float), len(points))
    fine_section, coarse_section = (SQUARE.fine, SQUARE.coarse) if square else (circle(20), equal_area_circle(8))
    stations = np.column_stack([points, wide, thick])
    fine = rounded(stations, rounding, steps=4)
    shell = loft(_swept(fine, fine_section, np.asarray(side, dtype=float)))
    coarse = _swept(simplified(stations, rounding), coarse_section, np.asarray(side, dtype=float))
    return Solid((shell,), tuple(np.concatenate(pair) for pair in pairwise(coarse)))


def arch(reach: Number, low: Number, high: Number) -> list[tuple[Number, Number, Number]]:
    """A path for a bow in the plane of x and z, from one foot up and over to the other."""
    side = [(reach, 0.0, low), (reach, 0.0, low + (high - low) * 0.6), (reach * 0.62, 0.0, high)]
    return [*((-x, y, z) for x, y, z in side), *reversed(side)]


def _swept(stations: Float64[np.ndarray, "station 5"], section: Curve, side: Float64[np.ndarray, "3"]) -> list[Points]:
    """Rings of a section across a path, mitred at its corners."""
    points = stations[:, :3]
    legs = np.diff(points, axis=0)
    legs = legs / np.sqrt((legs * legs).sum(axis=1, keepdims=True))
    tangents = np.concatenate([legs[:1], legs[:-1] + legs[1:], legs[-1:]])
    tangents = tangents / np.sqrt((tangents * tangents).sum(axis=1, keepdims=True))
    rings: list[Points] = []
    for station, tangent, leg in zip(stations, tangents, [*legs, legs[-1]], strict=True):
        mitre = 1.0 / max(float((tangent * leg).sum()), 0.5)
        normal = np.cross(tangent, side)
        across, within = section[:, :1] * side * station[3] / 2, section[:, 1:] * normal * station[4] / 2 * mitre
        rings.append(station[:3] + across + within)
    return rings


def open_box(x: Number, y: Number, z: Number, wall: Number, *, rounding: Number = 0.002) -> Solid:
    """A box without a lid: a floor and four walls."""
    floor = box(x, y, wall, rounding=rounding)
    long, short = box(x, wall, z, rounding=rounding), box(wall, y, z, rounding=rounding)
    walls = [
        long.at(y=(y - wall) / 2),
        long.at(y=(wall - y) / 2),
        short.at(x=(x - wall) / 2),
        short.at(x=(wall - x) / 2),
    ]
    return weld([floor, *walls])
