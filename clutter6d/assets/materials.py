"""What things are made of and coloured like: the materials and colours that an annotator may name."""

from dataclasses import dataclass


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
