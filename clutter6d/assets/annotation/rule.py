"""The annotator that needs nothing but the asset: material by name, mass by density, friction by material.

Values that are not open, for instance a category that a person set, are what it goes by.
"""

from typing import Any

from clutter6d.assets.annotation.annotator import Subject, Suggestion
from clutter6d.assets.annotation.volume import hull_volume_m3, solid_volume_m3
from clutter6d.assets.asset import Provenance
from clutter6d.assets.attribute_change import ATTRIBUTES, AttributeChange, value_of
from clutter6d.assets.attributes import derive_attributes
from clutter6d.assets.sources.base import AttributeHints

_MASS_DIGITS = 4
"""Significant digits of a mass; more would be the processor's."""


class RuleAnnotator:
    """The offline default."""

    origin: Provenance = "rule"
    needs_views = False

    def recall(self, subject: Subject) -> Suggestion:
        """The suggestion."""
        return self.annotate(subject)

    def annotate(self, subject: Subject) -> Suggestion:
        """The suggestion; the same for the same asset, always."""
        asset = subject.asset
        said: dict[str, Any] = {name: value_of(asset, name) for name in ATTRIBUTES if name not in subject.open}
        attributes, mass_kg = derive_attributes(
            name=asset.name,
            hints=AttributeHints(**said),
            visual=asset.visual,
            volume_m3=solid_volume_m3(asset),
            hull_volume_m3=hull_volume_m3(asset),
        )
        change = AttributeChange(
            category=attributes.category,
            colour=attributes.colour,
            material=attributes.material,
            mass_kg=float(f"{mass_kg:.{_MASS_DIGITS}g}"),
            friction=attributes.friction,
        )
        return Suggestion(change=change)
