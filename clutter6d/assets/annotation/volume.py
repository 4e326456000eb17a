"""How much room an asset takes, and what it may weigh."""

import manifold3d
import numpy as np

from clutter6d.assets.asset import Asset
from clutter6d.assets.convex_part import hull_of
from clutter6d.assets.materials import MATERIALS

LEAST_FILL = 0.015
"""Share of its solid that a hollow thing of a full mesh may have in material: the wall of a drinks can."""
VOLUME_SLACK = 1.25
"""By how much convex parts may fall short of the shape they stand for."""


def solid_volume_m3(asset: Asset) -> float:
    """Volume of the shape that the asset's parts were made from."""
    union = manifold3d.Manifold.batch_boolean(_hulls(asset), manifold3d.OpType.Add)
    return float(union.volume()) / asset.quality.volume_ratio


def hull_volume_m3(asset: Asset) -> float:
    """Volume of the convex hull of its parts."""
    return float(manifold3d.Manifold.batch_hull(_hulls(asset)).volume())


def plausible_mass_range_kg(asset: Asset, material: str) -> tuple[float, float]:
    """From a thin shell of a material's lightest kind to a full body of its heaviest.

    Args:
        asset: The asset.
        material: One of :data:`clutter6d.assets.attributes.MATERIALS`.
    """
    lightest, heaviest = MATERIALS[material].density_range
    volume = solid_volume_m3(asset)
    return lightest * LEAST_FILL * volume, heaviest * VOLUME_SLACK * volume


def _hulls(asset: Asset) -> list[manifold3d.Manifold]:
    found = (hull_of(part.vertices.astype(np.float64)) for part in asset.parts)
    return [hull for hull in found if hull is not None]
