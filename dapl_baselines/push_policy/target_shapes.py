"""What pushes need to know of the targets' shapes: where they can be touched, and some points of their surfaces."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float, Float32, Float64, Int

from clutter6d.assets.asset import Asset
from clutter6d.geometry import transform_points
from clutter6d.seeding import generator
from dapl_baselines.planners.contact_points import sample_contact_points

CONTACTS: Final = 64
"""Contact points of a target that pushes are drawn among."""
SURFACE_POINTS: Final = 32
"""Surface points of a target that a push is judged by."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TargetShapes:
    """Shapes of some targets, in the objects' frames [m].

    Attributes:
        index: Rows by the content hash of the asset.
        contacts: Contact points.
        normals: Outward unit normals there.
        surface: Surface points.
    """

    index: dict[str, int]
    contacts: Float64[np.ndarray, "target 64 3"]
    normals: Float64[np.ndarray, "target 64 3"]
    surface: Float32[np.ndarray, "target 32 3"]

    @classmethod
    def of(cls, assets: Iterable[Asset]) -> "TargetShapes":
        """The shapes of assets, in the order of their hashes."""
        by_hash = {asset.content_hash: asset for asset in assets}
        ordered = [by_hash[name] for name in sorted(by_hash)]
        touched = [sample_contact_points(asset) for asset in ordered]
        return cls(
            index={asset.content_hash: row for row, asset in enumerate(ordered)},
            contacts=np.stack([np.resize(each.points[:CONTACTS], (CONTACTS, 3)) for each in touched]),
            normals=np.stack([np.resize(each.normals[:CONTACTS], (CONTACTS, 3)) for each in touched]),
            surface=np.stack([_draw_surface(asset) for asset in ordered]),
        )

    def rows_of(self, assets: Iterable[Asset]) -> Int[np.ndarray, "asset"]:
        """The rows of assets."""
        return np.array([self.index[asset.content_hash] for asset in assets], dtype=np.int64)

    def placed_contacts(
        self, rows: Int[np.ndarray, "slot"], poses: Float[np.ndarray, "slot 7"]
    ) -> Float64[np.ndarray, "slot 64 3"]:
        """The contact points of targets at poses, world frame [m]."""
        return transform_points(poses, self.contacts[rows])


def _draw_surface(asset: Asset) -> Float32[np.ndarray, "32 3"]:
    points = asset.surface_points
    return points[generator(0, "pushed surface", asset.content_hash).permutation(len(points))[:SURFACE_POINTS]]
