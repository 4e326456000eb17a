"""The procedural asset source: seeded objects of every family, without a download."""

import hashlib
import re
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import zip_longest
from pathlib import Path
from types import MappingProxyType

from clutter6d.assets.asset import Licence
from clutter6d.assets.sources.base import AttributeHints, RawShape, SourceObject
from clutter6d.assets.sources.procedural import (
    containers,
    electronics,
    hardware,
    household,
    kitchen,
    office,
    ornaments,
    packaging,
    tableware,
    tools,
    toys,
)
from clutter6d.assets.sources.procedural.design import Design
from clutter6d.assets.sources.procedural.family import Family
from clutter6d.assets.sources.procedural.palette import material
from clutter6d.errors import InvalidValueError, UnknownNameError

VERSION = "v1"
"""Changes whenever an existing key would give another shape."""

DEFAULT_COUNT = 512
_KEY = re.compile(rf"{VERSION}/(?P<family>[a-z-]+)/(?P<index>\d{{4,}})/seed(?P<seed>\d+)")
_THEMES = (tableware, kitchen, containers, packaging, office, tools, hardware, toys, electronics, household, ornaments)
_OF_THEME = [[item for item in vars(theme).values() if isinstance(item, Family)] for theme in _THEMES]

FAMILIES: Mapping[str, Family] = MappingProxyType(
    {item.name: item for row in zip_longest(*_OF_THEME) for item in row if item is not None}
)
"""Every family by name, one of each theme in turn, so that a few objects are already various."""


class ProceduralSource:
    """Household and workshop objects, drawn from a seed and balanced over their families.

    Args:
        seed: The user's seed, not negative; another seed gives other objects.
        count: How many objects there are; the first n of a larger count are the objects of a count of n.
        families: Names of the families to draw from; all of them if ``None``.

    Raises:
        InvalidValueError: The count or the seed is negative, or no family is named.
        UnknownNameError: There is no family of that name.
    """

    def __init__(self, seed: int = 0, count: int = DEFAULT_COUNT, families: Sequence[str] | None = None) -> None:
        if count < 0 or seed < 0:
            raise InvalidValueError(f"procedural source: seed {seed} and count {count} must not be negative")
        names = tuple(FAMILIES) if families is None else tuple(families)
        if not names:
            raise InvalidValueError(
                "procedural source: 'families' is empty; name at least one, or leave it out for all"
            )
        for name in names:
            family_named(name)
        self._seed, self._count, self._families = seed, count, names

    @property
    def name(self) -> str:
        """``procedural``."""
        return "procedural"

    def objects(self) -> Sequence[SourceObject]:
        """All objects, one of each family in turn."""
        keys = ((self._families[i % len(self._families)], i // len(self._families)) for i in range(self._count))
        return tuple(_listed(family_name, index, self._seed) for family_name, index in keys)

    def fingerprint(self, item: SourceObject) -> str:
        """Hash of the key and of this package's source text."""
        return hashlib.sha256(f"{_source_hash()}/{item.key}".encode()).hexdigest()

    def load(self, item: SourceObject) -> RawShape:
        """Build the shape that the key names.

        Raises:
            InvalidValueError: The key is not of this source and version.
            UnknownNameError: There is no family of that name.
        """
        return design_of(item.key).shape()


def family_named(name: str) -> Family:
    """A family by name.

    Raises:
        UnknownNameError: There is no such family.
    """
    if name not in FAMILIES:
        raise UnknownNameError("procedural family", name, FAMILIES)
    return FAMILIES[name]


def design_of(key: str) -> Design:
    """The design that a key such as ``"v1/mug/0003/seed0"`` names.

    Raises:
        InvalidValueError: The key is not of this source and version.
        UnknownNameError: There is no family of that name.
    """
    match = _KEY.fullmatch(key)
    if match is None:
        raise InvalidValueError(f"procedural key '{key}' is not of the form '{VERSION}/FAMILY/0000/seed0'")
    return family_named(match["family"]).design(int(match["seed"]), int(match["index"]))


def _listed(family_name: str, index: int, seed: int) -> SourceObject:
    key = f"{VERSION}/{family_name}/{index:04d}/seed{seed}"
    design = design_of(key)
    main = design.pieces[0]
    hints = AttributeHints(
        category=family_name,
        colour=main.colour,
        material=main.material,
        mass_kg=design.balance().mass_kg,
        friction=material(main.material).friction,
    )
    licence = Licence(name="Apache-2.0", author="The Clutter6D developers", source="procedural", source_id=key)
    suffix = f"-s{seed}" if seed else ""
    return SourceObject(key=key, name=f"{family_name}-{index:04d}{suffix}", licence=licence, hints=hints)


@cache
def _source_hash() -> str:
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
