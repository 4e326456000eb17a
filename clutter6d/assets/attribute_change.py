"""Changing what is said of an asset: an annotator's answer or a person's decision, as a new version of the asset."""

import math
from dataclasses import dataclass, fields, replace

from clutter6d.assets.asset import Asset, MassProperties, Provenance, hash_asset
from clutter6d.errors import InvalidValueError

MAX_MASS_KG = 50.0
MAX_FRICTION = 4.0
MAX_WORD_LENGTH = 60


@dataclass(frozen=True, kw_only=True, slots=True)
class AttributeChange:
    """New values of an asset's attributes; ``None`` keeps what there is.

    Attributes:
        category: What the object is, for instance ``"coffee-mug"``; at most 60 printable characters.
        colour: Name of its main colour; likewise.
        material: Name of its main material; likewise.
        mass_kg: In (0, 50].
        friction: Sliding friction on a wooden table, in (0, 4].

    Raises:
        InvalidValueError: A value is out of its range.
    """

    category: str | None = None
    colour: str | None = None
    material: str | None = None
    mass_kg: float | None = None
    friction: float | None = None

    def __post_init__(self) -> None:
        for name in ("category", "colour", "material"):
            _check_word(name, getattr(self, name))
        _check_number("mass_kg", self.mass_kg, MAX_MASS_KG)
        _check_number("friction", self.friction, MAX_FRICTION)

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the values that it brings."""
        return tuple(field.name for field in fields(self) if getattr(self, field.name) is not None)

    def only(self, *names: str) -> "AttributeChange":
        """The same change without the values of other names."""
        return AttributeChange(**{name: getattr(self, name) for name in names})


ATTRIBUTES = tuple(field.name for field in fields(AttributeChange))
"""Names of all values."""


def value_of(asset: Asset, name: str) -> str | float:
    """A value of an asset by its name in :class:`AttributeChange`."""
    return asset.mass_properties.mass_kg if name == "mass_kg" else getattr(asset.attributes, name)


def changed_asset(asset: Asset, change: AttributeChange, *, by: Provenance) -> Asset:
    """The asset with new values, its inertia scaled with its mass, and its new content hash.

    Args:
        asset: Stays as it is.
        change: What to change; every value it gives, even one equal to the old, is said to come from ``by``.
        by: Whose values these are.

    Returns:
        The changed asset, of the same name; store it with :meth:`clutter6d.assets.library.AssetLibrary.replace`.
    """
    words = {name: getattr(change, name) for name in change.given if name != "mass_kg"}
    origins = {f"{name.removesuffix('_kg')}_from": by for name in change.given}
    changed = replace(
        asset,
        attributes=replace(asset.attributes, **words, **origins),
        mass_properties=_scaled(asset.mass_properties, change.mass_kg),
    )
    return replace(changed, content_hash=hash_asset(changed))


def _scaled(properties: MassProperties, mass_kg: float | None) -> MassProperties:
    """The same distribution of another mass."""
    if mass_kg is None or mass_kg == properties.mass_kg:
        return properties
    return MassProperties(mass_kg=mass_kg, inertia=properties.inertia * (mass_kg / properties.mass_kg))


def _check_word(name: str, value: str | None) -> None:
    if value is None:
        return
    if not value or value != value.strip() or not value.isprintable() or len(value) > MAX_WORD_LENGTH:
        shown = value[:MAX_WORD_LENGTH]
        raise InvalidValueError(
            f"{name} {shown!r}: must be 1 to {MAX_WORD_LENGTH} printable characters with no space at its ends"
        )


def _check_number(name: str, value: float | None, largest: float) -> None:
    if value is not None and not (math.isfinite(value) and 0 < value <= largest):
        raise InvalidValueError(f"{name} {value}: must be above 0 and at most {largest:g}")
