"""From one version of an asset to the next and back: what an edit changes, and what undoing it restores."""

from dataclasses import replace

import numpy as np

from clutter6d.assets.asset import Asset, Attributes, MassProperties, hash_asset
from clutter6d.assets.asset_file import AttributesModel
from clutter6d.assets.attribute_change import AttributeChange, changed_asset, value_of
from clutter6d.assets.review.entry import EditableField, FieldChange, FormerValues


def former_values(asset: Asset) -> FormerValues:
    """What an edit of the asset would replace."""
    attributes = {name: getattr(asset.attributes, name) for name in Attributes.__slots__}
    return FormerValues(
        attributes=AttributesModel(**attributes),
        mass_kg=asset.mass_properties.mass_kg,
        inertia=tuple(asset.mass_properties.inertia.ravel().tolist()),
    )


def restored_asset(asset: Asset, former: FormerValues) -> Asset:
    """The version of an asset that an edit replaced."""
    inertia = np.array(former.inertia, dtype=np.float64).reshape(3, 3)
    restored = replace(
        asset,
        attributes=Attributes(**former.attributes.model_dump()),
        mass_properties=MassProperties(mass_kg=former.mass_kg, inertia=inertia),
    )
    return replace(restored, content_hash=hash_asset(restored))


def field_changes(asset: Asset, change: AttributeChange) -> tuple[FieldChange, ...]:
    """Which values of an asset a change replaces, and by what."""
    fields: tuple[EditableField, ...] = ("category", "colour", "material", "mass_kg", "friction")
    return tuple(
        FieldChange(field=name, before=value_of(asset, name), after=getattr(change, name))
        for name in fields
        if name in change.given
    )


def edited_asset(asset: Asset, changes: tuple[FieldChange, ...]) -> Asset:
    """The asset with the new values, each said to come from a person.

    Raises:
        InvalidValueError: A value is out of its range.
    """
    values = {change.field: change.after for change in changes}
    return changed_asset(asset, AttributeChange(**values), by="person")  # pyright: ignore[reportArgumentType]
