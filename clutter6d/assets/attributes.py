"""Semantic attributes by rule: material and mass from the object's name, a colour's name from its RGBA.

Every value says where it came from. What the source states wins over a rule.
"""

import colorsys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clutter6d.assets.asset import Attributes, Provenance, VisualMesh
from clutter6d.assets.sources.base import AttributeHints

MASS_RANGE_KG = (0.01, 5.0)
"""What an arm pushes without effort, and what a hand would still notice [kg]."""
BULK_DENSITY_RANGE = (40.0, 3000.0)
"""Mass over the hull's volume [kg/m^3], from an empty carton to solid stone."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Material:
    """A material's density [kg/m^3] and its sliding friction on a wooden table."""

    density: float
    friction: float


MATERIALS = {
    "ceramic": Material(density=2300, friction=0.45),
    "glass": Material(density=2500, friction=0.40),
    "metal": Material(density=5000, friction=0.40),
    "plastic": Material(density=1000, friction=0.35),
    "wood": Material(density=650, friction=0.50),
    "paper": Material(density=700, friction=0.50),
    "fabric": Material(density=250, friction=0.70),
    "rubber": Material(density=1100, friction=0.90),
    "food": Material(density=700, friction=0.55),
    "plant": Material(density=400, friction=0.55),
    "stone": Material(density=2600, friction=0.60),
    "wax": Material(density=900, friction=0.45),
    "leather": Material(density=500, friction=0.60),
}

_MATERIAL_WORDS = {
    "ceramic": "mug cup plate bowl teapot vase pottery jar creamer ashtray sink lavatory toilet bidet saucer ceramic",
    "glass": "glass bottle flacon wine beer cocktail mirror lens aquarium glasses",
    "metal": (
        "scissors knife fork spoon hammer screwdriver pliers wrench pan kettle faucet key keys ring lock "
        "safe can tin shovel tool tape-measure locker radiator rack metal steel cutlery oven stove stapler tool saw"
    ),
    "wood": (
        "wood wooden pencil chopping board table stool chair shelf crate cabinet box-wood ruler guitar xylophone "
        "chessboard hanger bedside drawer toy train bat frame"
    ),
    "paper": "book newspaper calendar card cardboard letter box-cardboard bill notebook magazine paper gift carton",
    "fabric": (
        "towel clothes skirt suit short cap hat glove teddy bear pillow doormat socket-sock doll sponge backpack bag "
        "handbag socks plush"
    ),
    "rubber": "tire ball basketball soccer boot bootie rubber",
    "leather": "shoe shoes slippers mocassin sneakers briefcase wallet belt",
    "food": "bread cake hamburger hot-dog chicken steak sushi apple apples fruit butter sugar fries cup-cake food egg",
    "plant": "plant flower flowers cactus bonsai bamboo tulips orchids lily succulent tree",
    "stone": "rock stone brick",
    "wax": "candle soap lip stick",
}
_HOLLOW_WORDS = (
    "box cabinet oven stove microwave fryer printer laptop tv speaker amplifier stereo toaster radio camera projector "
    "phone computer ibook imac player playstation monitor lamp lantern light case briefcase helmet machine maker "
    "brewer mixer blender drill grinder squeezer shaver razor iron fan heater "
    "boiler safe locker bin dustbin crate drawer basketball ball soccer bag backpack "
    "handbag gift hood cooker cooktop induction base station detector socket plug switch bottle jar flacon shoe shoes "
    "sneakers bootie boot mocassin slippers train car biplane toy tricycle recycling bread-box cardboard dvd hifi mp3"
).split()
_FILL = {"hollow": 0.25, "solid": 1.0}
_MATERIAL_OF = {word: material for material, words in _MATERIAL_WORDS.items() for word in words.split()}

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


def material_of(words: Sequence[str]) -> str:
    """The material that a name states, else that of the thing it names, the last word first; else plastic."""
    stated = [word for word in words if word in MATERIALS]
    named = [_MATERIAL_OF[word] for word in reversed(words) if word in _MATERIAL_OF]
    return (stated + named + ["plastic"])[0]


def plausible_mass_kg(words: Sequence[str], material: Material, volume_m3: float, hull_volume_m3: float) -> float:
    """Density times volume, a quarter of it for things that are hollow in life; within what household things weigh."""
    fill = _FILL["hollow" if any(word in _HOLLOW_WORDS for word in words) else "solid"]
    low, high = (density * hull_volume_m3 for density in BULK_DENSITY_RANGE)
    return float(np.clip(np.clip(material.density * fill * volume_m3, low, high), *MASS_RANGE_KG))


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
