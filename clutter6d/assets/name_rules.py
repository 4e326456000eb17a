"""What an object's name tells: its material, and how much of its hull is filled with it.

These rules are part of the hash of every asset that is made with them: a change of them is a new
``PROCESSING_VERSION``.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TypeVar

from clutter6d.assets.materials import MATERIALS

Known = TypeVar("Known")

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


def material_of(words: Sequence[str]) -> str:
    """The material that a name states, else that of the thing it names, the last word first; else plastic."""
    stated = [word for word in words if word in MATERIALS and word not in _THINGS]
    return (stated + _looked_up(words, _MATERIAL_OF) + ["plastic"])[0]


def fill_of(words: Sequence[str]) -> float:
    """Share of its hull that such a thing's material fills at most; above 1, how much denser than that it is."""
    return (_looked_up(words, _FILL_OF) + [1.0])[0]


def _looked_up(words: Sequence[str], table: Mapping[str, Known]) -> list[Known]:
    """What a table says of a name: of two words together first, then of the last word, then of those before it."""
    named = list(words[: words.index("with")] if "with" in words else words)
    named = [word for word in named[:-1] if word not in _BRANDS] + named[-1:]
    pairs = [f"{first}-{second}" for first, second in pairwise(named)]
    return [table[word] for word in (*reversed(pairs), *reversed(named)) if word in table]
