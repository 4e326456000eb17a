"""What procedural objects are made of: materials with density and friction, and colours with names."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from clutter6d.errors import UnknownNameError

Rgba = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Material:
    """A material's density [kg/m^3], sliding friction against a wooden table, and natural colours."""

    density: float
    friction: float
    colours: tuple[str, ...]


COLOURS: Mapping[str, str] = MappingProxyType(
    {
        "white": "f2efe8", "ivory": "e8dcc0", "grey": "8d9196", "graphite": "3c4147", "black": "24262a",
        "red": "c8442f", "brick": "a9533c", "terracotta": "c9714a", "orange": "e8863a", "amber": "d99a2b",
        "yellow": "ecc548", "mustard": "c79c33", "lime": "a3bf4a", "green": "4f9a55", "forest": "2f6b4f",
        "sage": "9db596", "mint": "a5d3bd", "teal": "2b8a8a", "turquoise": "4fb8b5", "sky": "7fb4dc",
        "blue": "3a74b8", "navy": "2b4170", "indigo": "50509b", "violet": "8a66a8", "plum": "74405f",
        "pink": "e08fa0", "rose": "c75f78", "cream": "f0e2bd", "sand": "d3b88c", "kraft": "bd9468",
        "oak": "c39a63", "pine": "ddb97e", "walnut": "7a5238", "mahogany": "84442f", "brown": "6d4a33",
        "steel": "b4b9be", "iron": "4a4b4f", "copper": "b9744f", "brass": "c8a24e", "bottle-green": "3f7355",
        "clear": "cfe3e6",
    }
)  # fmt: skip
"""sRGB colours by name."""

_BRIGHT = ("red", "orange", "yellow", "green", "teal", "blue", "navy", "violet", "white", "sky", "lime", "pink")
_GLAZES = ("white", "ivory", "terracotta", "sage", "mint", "sky", "navy", "teal", "graphite", "mustard", "rose", "plum")

MATERIALS: Mapping[str, Material] = MappingProxyType(
    {
        "ceramic": Material(2300.0, 0.45, _GLAZES),
        "glass": Material(2500.0, 0.35, ("bottle-green", "clear", "amber", "sky", "turquoise")),
        "plastic": Material(1000.0, 0.40, (*_BRIGHT, "grey", "graphite", "mint")),
        "wood": Material(650.0, 0.50, ("oak", "pine", "walnut", "mahogany")),
        "steel": Material(7800.0, 0.35, ("steel", "iron")),
        "iron": Material(7200.0, 0.45, ("iron", "graphite", "black")),
        "aluminium": Material(2700.0, 0.35, ("steel", "grey")),
        "brass": Material(8500.0, 0.35, ("brass", "copper")),
        "cardboard": Material(690.0, 0.50, ("kraft", "sand", "cream", "red", "blue", "yellow", "green", "orange")),
        "paper": Material(800.0, 0.50, ("white", "cream", "ivory", "sky", "mint")),
        "rubber": Material(1150.0, 0.90, ("black", "graphite", "red", "blue")),
        "leather": Material(860.0, 0.60, ("brown", "black", "mahogany", "navy", "sand")),
        "fabric": Material(300.0, 0.65, ("red", "navy", "sage", "grey", "teal", "rose", "white")),
        "clay": Material(1900.0, 0.65, ("brick", "terracotta", "sand", "grey")),
        "wax": Material(930.0, 0.50, ("ivory", "cream", "rose", "sage", "plum", "sky", "red")),
        "food": Material(1000.0, 0.50, ("yellow", "mustard", "cream", "brown")),
        "sponge": Material(90.0, 0.70, ("yellow", "mint", "sky", "pink")),
    }
)


def material(name: str) -> Material:
    """A material by name.

    Raises:
        UnknownNameError: There is no such material.
    """
    if name not in MATERIALS:
        raise UnknownNameError("material", name, MATERIALS)
    return MATERIALS[name]


def rgba(colour: str, alpha: float = 1.0) -> Rgba:
    """A named colour as RGBA in [0, 1].

    Raises:
        UnknownNameError: There is no such colour.
    """
    if colour not in COLOURS:
        raise UnknownNameError("colour", colour, COLOURS)
    red, green, blue = (int(COLOURS[colour][i : i + 2], 16) / 255 for i in (0, 2, 4))
    return (round(red, 4), round(green, 4), round(blue, 4), alpha)


def pick(rng: np.random.Generator, choices: Sequence[str]) -> str:
    """One of the choices, each as likely."""
    return choices[int(rng.integers(len(choices)))]
