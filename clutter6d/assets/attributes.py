"""Semantic attributes by rule: material and mass from the object's name, a colour's name from its RGBA.

Every value says where it came from. What the source states wins over a rule. What the rules give is part of the hash
of every asset that is made with them: a change of them is a new ``PROCESSING_VERSION``.
"""

import colorsys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import numpy as np

from clutter6d.assets.asset import Attributes, Provenance, VisualMesh
from clutter6d.assets.sources.base import AttributeHints

Known = TypeVar("Known")

MASS_RANGE_KG = (0.01, 5.0)
"""What an arm pushes without effort, and what a hand would still notice [kg]."""
BULK_DENSITY_RANGE = (40.0, 3000.0)
"""Mass over the hull's volume [kg/m^3], from an empty carton to solid stone."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Material:
    """What a household thing of some material is like.

    Attributes:
        density: Typical [kg/m^3].
        density_range: Lightest and heaviest of things that are mostly of it, with what is in them, as a phone's battery
            or a pot's earth [kg/m^3].
        friction: Sliding friction on a wooden table.
    """

    density: float
    density_range: tuple[float, float]
    friction: float


MATERIALS = {
    "ceramic": Material(density=2300, density_range=(1700, 2800), friction=0.45),
    "glass": Material(density=2500, density_range=(2200, 3000), friction=0.40),
    "metal": Material(density=5000, density_range=(1700, 9000), friction=0.40),
    "plastic": Material(density=1000, density_range=(800, 2300), friction=0.35),
    "wood": Material(density=650, density_range=(150, 1200), friction=0.50),
    "paper": Material(density=700, density_range=(250, 1300), friction=0.50),
    "fabric": Material(density=250, density_range=(40, 900), friction=0.70),
    "rubber": Material(density=1100, density_range=(500, 1700), friction=0.90),
    "food": Material(density=700, density_range=(150, 1400), friction=0.55),
    "plant": Material(density=400, density_range=(80, 1700), friction=0.55),
    "stone": Material(density=2600, density_range=(1500, 3300), friction=0.60),
    "wax": Material(density=900, density_range=(750, 1100), friction=0.45),
    "leather": Material(density=500, density_range=(300, 1200), friction=0.60),
    "steel": Material(density=7800, density_range=(7500, 8100), friction=0.35),
    "iron": Material(density=7200, density_range=(6800, 7900), friction=0.45),
    "aluminium": Material(density=2700, density_range=(2500, 2900), friction=0.35),
    "brass": Material(density=8500, density_range=(8100, 9000), friction=0.35),
    "cardboard": Material(density=690, density_range=(50, 1300), friction=0.50),
    "clay": Material(density=1900, density_range=(1500, 2300), friction=0.65),
    "foam": Material(density=60, density_range=(10, 250), friction=0.70),
}
"""The materials that an annotator may name."""

COLOURS = (
    "black", "white", "grey", "silver", "gold", "red", "orange", "yellow", "green", "cyan", "blue", "purple", "pink",
    "brown", "beige", "transparent", "multicoloured",
)  # fmt: skip
"""The colours that an annotator may name; a rule names those of a single RGBA."""

_MATERIAL_WORDS = {
    "ceramic": (
        "mug cup plate bowl teapot vase pottery jar creamer ashtray hashtray sink lavatory toilet bidet saucer ceramic "
        "piggy-bank"
    ),
    "glass": (
        "glass bottle flacon wine beer cocktail mirror lens aquarium glasses shaker square-bottle soap-dispenser "
        "salt-shaker light-bulb pitcher"
    ),
    "metal": (
        "scissors knife fork spoon hammer screwdriver pliers wrench pan pot kettle faucet key keys ring lock padlock "
        "safe can tin shovel tool locker radiator rack metal steel copper silver gold cutlery "
        "oven stove stapler saw bolt nut gear hinge bracket cleaver trowel pipe dumbbell pastry-cutter cutter "
        "hand-wheel thimble wire nail screw anvil coathanger chain tongs"
    ),
    "plastic": (
        "dispenser brush paint-brush fan machine maker brewer player projector lamp light clock camera phone iphone "
        "ibook imac ipad laptop computer keyboard mouse printer monitor tablet station case tape remote device sign "
        "spray-bottle baby-bottle pill-bottle yogurt-bottle watering-can tape-measure tape-dispenser clothes-iron "
        "lighter cosmetics-pot ring-stack game-controller helmet socket plug switch detector container"
    ),
    "wood": (
        "wood wooden pencil chopping board table stool chair shelf crate cabinet box-wood ruler guitar xylophone "
        "chessboard hanger bedside drawer toy train bat frame pencil-case spool rolling-pin mallet spinning-top basket "
        "candle-stick knife-stand"
    ),
    "paper": (
        "book newspaper calendar card cardboard letter box carton bill notebook magazine paper gift ring-binder binder "
        "egg-carton tissue-box paper-roll game"
    ),
    "fabric": (
        "towel clothes skirt suit short cap hat glove teddy bear pillow doormat sock doll sponge backpack bag "
        "handbag socks plush"
    ),
    "rubber": "tire tyre ball basketball soccer boot bootie rubber duck",
    "leather": "shoe shoes slippers mocassin sneakers briefcase wallet belt",
    "food": (
        "bread cake hamburger hot-dog chicken steak sushi apple apples fruit fruits butter sugar fries cup-cake food "
        "egg cheese cheese-wedge banana sandwich pizza salad"
    ),
    "plant": "plant flower flowers cactus bonsai bamboo tulips orchids lily succulent tree",
    "stone": "rock stone brick plant-pot flower-pot",
    "wax": "candle soap lip stick",
}
_MATERIAL_OF = {word: material for material, words in _MATERIAL_WORDS.items() for word in words.split()}
_BRANDS = frozenset({"apple"})
"""Words that name a thing only where they stand last."""
_THINGS = frozenset({"iron"})
"""Materials whose word, in a name, means a thing."""

_FILL_WORDS = {
    0.07: "ball basketball soccer cardboard cardboard-box balloon egg-carton can watering-can helmet",
    0.1: (
        "lamp light fan bicycle spray-bottle baby-bottle yogurt-bottle bucket basket bin dustbin crate lantern hat cap "
        "bag handbag"
    ),
    0.2: (
        "mug cup bowl vase glass jar pot pan kettle creamer teapot pitcher tray plate saucer ashtray hashtray bottle "
        "flacon sink bidet toilet lavatory plant-pot flower-pot pencil-cup shaker dispenser backpack case "
        "briefcase teddy bear pillow plush doll cat dog deer bird rabbit horse elephant piggy-bank chair stool table"
    ),
    0.25: (
        "box cabinet oven stove microwave fryer tv speaker amplifier stereo toaster radio imac monitor machine maker "
        "brewer cooker hood safe locker drawer train car biplane boat house toy tricycle bread-box cooktop induction "
        "base station detector socket plug switch shoe shoes sneakers bootie boot mocassin slippers recycling dvd hifi "
        "boiler chest loudspeaker gift carton tissue-box"
    ),
    0.4: (
        "bread cake cup-cake hamburger printer playstation player projector heater mixer blender squeezer clock "
        "paper-roll binder ring-binder plant flower flowers tulips orchids bamboo bonsai"
    ),
    0.6: (
        "drill grinder razor shaver clothes-iron torch flashlight keyboard game-controller remote tape-dispenser phone "
        "surveillance-camera"
    ),
    1.0: "drinks-carton milk-carton juice-carton bat",
    1.3: "mobile-phone iphone camera ibook laptop tablet ipad watch mouse battery",
}
"""Share of its hull that a thing's material fills in life, of things that meshes show full; above 1, what is denser."""

_FILL_OF = {word: fill for fill, words in _FILL_WORDS.items() for word in words.split()}

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
    stated = [word for word in words if word in MATERIALS and word not in _THINGS]
    return (stated + _looked_up(words, _MATERIAL_OF) + ["plastic"])[0]


def plausible_mass_kg(words: Sequence[str], material: Material, volume_m3: float, hull_volume_m3: float) -> float:
    """Density times volume, but no more of the hull than such a thing fills; within what household things weigh."""
    fill = (_looked_up(words, _FILL_OF) + [1.0])[0]
    low, high = (density * hull_volume_m3 for density in BULK_DENSITY_RANGE)
    filled_m3 = fill * volume_m3 if fill > 1 else min(volume_m3, fill * hull_volume_m3)
    return float(np.clip(np.clip(material.density * filled_m3, low, high), *MASS_RANGE_KG))


def _looked_up(words: Sequence[str], table: Mapping[str, Known]) -> list[Known]:
    """What a table says of a name: of two words together first, then of the last word, then of those before it."""
    named = list(words[: words.index("with")] if "with" in words else words)
    named = [word for word in named[:-1] if word not in _BRANDS] + named[-1:]
    pairs = [f"{first}-{second}" for first, second in pairwise(named)]
    return [table[word] for word in (*reversed(pairs), *reversed(named)) if word in table]


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
