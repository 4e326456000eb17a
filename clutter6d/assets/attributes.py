"""Semantic attributes by rule: material and mass from the object's name, a colour's name from its RGBA.

Every value says where it came from. What the source states wins over a rule. What the rules give is part of the hash
of every asset that is made with them: a change of them is a new ``PROCESSING_VERSION``.
"""

import colorsys
from collections.abc import Sequence

import numpy as np

from clutter6d.assets.asset import Attributes, Provenance, VisualMesh
from clutter6d.assets.materials import MATERIALS, Material
from clutter6d.assets.name_rules import fill_of, material_of
from clutter6d.assets.sources.base import AttributeHints

MASS_RANGE_KG = (0.01, 5.0)
"""What an arm pushes without effort, and what a hand would still notice [kg]."""
BULK_DENSITY_RANGE = (40.0, 3000.0)
"""Mass over the hull's volume [kg/m^3], from an empty carton to solid stone."""

_HUES = (
    (0.03, "red"), (0.10, "orange"), (0.19, "yellow"), (0.45, "green"), (0.53, "cyan"), (0.72, "blue"),
    (0.83, "purple"), (0.94, "pink"), (1.01, "red"),
)  # fmt: skip


def derive_attributes(
    *,
    name: str,
    hints: AttributeHints,
    visual: Sequence[VisualMesh],
    volume_m3: float,
    hull_volume_m3: float,
) -> tuple[Attributes, float]:
    """Attributes and mass of an object.

    Args:
        name: The object's name, as words joined by hyphens.
        hints: What its source states.
        visual: Its colours.
        volume_m3: Volume of its solid.
        hull_volume_m3: Volume of its convex hull.

    Returns:
        The attributes, and the mass [kg].
    """
    words = _words(hints.category or name)
    category = hints.category or "-".join(words) or "object"
    material = hints.material or material_of(words)
    known = MATERIALS.get(material, MATERIALS["plastic"])
    mass = hints.mass_kg or plausible_mass_kg(words, known, volume_m3, hull_volume_m3)
    return Attributes(
        category=category,
        colour=hints.colour or dominant_colour(visual),
        material=material,
        friction=hints.friction or known.friction,
        category_from=_origin(hints.category),
        colour_from=_origin(hints.colour),
        material_from=_origin(hints.material),
        mass_from=_origin(hints.mass_kg),
        friction_from=_origin(hints.friction),
    ), mass


def plausible_mass_kg(words: Sequence[str], material: Material, volume_m3: float, hull_volume_m3: float) -> float:
    """Density times volume, but no more of the hull than such a thing fills; within what household things weigh."""
    fill = fill_of(words)
    low, high = (density * hull_volume_m3 for density in BULK_DENSITY_RANGE)
    filled_m3 = fill * volume_m3 if fill > 1 else min(volume_m3, fill * hull_volume_m3)
    return float(np.clip(np.clip(material.density * filled_m3, low, high), *MASS_RANGE_KG))


def dominant_colour(visual: Sequence[VisualMesh]) -> str:
    """Name of the colour that covers most of the surface."""
    areas: dict[str, float] = {}
    for item in visual:
        corners = item.mesh.vertices[item.mesh.faces].astype(np.float64)
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        name = colour_name(item.rgba)
        areas[name] = areas.get(name, 0.0) + float(np.linalg.norm(cross, axis=1).sum())
    return max(areas, key=lambda name: areas[name])


def colour_name(rgba: tuple[float, float, float, float]) -> str:
    """An English colour word."""
    hue, saturation, value = colorsys.rgb_to_hsv(*rgba[:3])
    if value < 0.18:
        return "black"
    if saturation < 0.15:
        return "white" if value > 0.85 else "grey"
    if 0.02 < hue < 0.14 and value < 0.65:
        return "brown"
    return next(name for limit, name in _HUES if hue < limit)


def _words(name: str) -> list[str]:
    return [word for word in name.lower().replace("_", "-").split("-") if word and not word.isdigit()]


def _origin(hint: object) -> Provenance:
    return "rule" if hint is None else "source"
