"""How far the rule-based annotator is off on procedural objects, which declare their own material and mass.

python benchmarks/attribute_rules.py
"""

import numpy as np

from clutter6d.assets.annotation.annotator import Subject
from clutter6d.assets.annotation.rule import RuleAnnotator
from clutter6d.assets.asset import Asset
from clutter6d.assets.named_libraries import open_library

KIND_OF = {
    "steel": "metal", "iron": "metal", "aluminium": "metal", "brass": "metal", "cardboard": "paper",
    "clay": "ceramic", "stone": "ceramic", "sponge": "fabric", "foam": "fabric",
}  # fmt: skip
GIVEN = {
    "category": frozenset({"material", "mass_kg", "friction"}),
    "category and material": frozenset({"mass_kg", "friction"}),
}


def main() -> None:
    library = open_library("procedural")
    assets = [library.load(name) for name in library.names()]
    families = {asset.attributes.category for asset in assets}
    print(f"{len(assets)} objects of {len(families)} families")
    for given, opened in GIVEN.items():
        factors = np.array([mass_factor(asset, opened) for asset in assets])
        middle, most = np.quantile(factors, (0.5, 0.9))
        print(f"told {given}: mass off by {middle:.2f} (median), {most:.2f} (p90); {(factors < 2).mean():.0%} within 2")
    right = sum(is_of_right_kind(asset) for asset in assets)
    print(f"material of the right kind: {right} of {len(assets)}")


def mass_factor(asset: Asset, opened: frozenset[str]) -> float:
    """By how much the rule's mass is above or below the declared one, as a factor of at least 1."""
    mass_kg = RuleAnnotator().annotate(Subject(asset=asset, open=opened)).change.mass_kg or np.nan
    ratio = mass_kg / asset.mass_properties.mass_kg
    return max(ratio, 1 / ratio)


def is_of_right_kind(asset: Asset) -> bool:
    """Whether the rule's material is the declared one, or of its kind."""
    suggested = RuleAnnotator().annotate(Subject(asset=asset, open=GIVEN["category"])).change.material or ""
    declared = asset.attributes.material
    return KIND_OF.get(suggested, suggested) == KIND_OF.get(declared, declared)


if __name__ == "__main__":
    main()
