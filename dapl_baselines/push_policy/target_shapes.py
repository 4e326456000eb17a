"""What pushes need to know of the targets' shapes: where they can be touched, and some points of their surfaces."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float, Float32, Float64, Int

from clutter6d.assets.asset import Asset
from clutter6d.geometry import transform_points
from dapl_baselines.planners.contact_points import sample_contact_points

CONTACTS: Final = 64
"""Contact points of a target that pushes are drawn among."""
SURFACE_POINTS: Final = 48
"""Surface points of a target that a push is judged by: its outermost ones, in directions spread over the sphere.

They tell better than as many random ones on what an object stands, and over which edge it tips.
"""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TargetShapes:
    """Shapes of some targets, in the objects' frames [m].

    Attributes:
        index: Rows by the content hash of the asset.
        contacts: Contact points.
        normals: Outward unit normals there.
        surface: Their outermost surface points.
    """

    index: dict[str, int]
    contacts: Float64[np.ndarray, "target 64 3"]
    normals: Float64[np.ndarray, "target 64 3"]
    surface: Float32[np.ndarray, "target 48 3"]

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
            surface=np.stack([outermost(asset.surface_points) for asset in ordered]),
        )

    def rows_of(self, assets: Iterable[Asset]) -> Int[np.ndarray, "asset"]:
        """The rows of assets."""
        return np.array([self.index[asset.content_hash] for asset in assets], dtype=np.int64)

    def placed_contacts(
        self, rows: Int[np.ndarray, "slot"], poses: Float[np.ndarray, "slot 7"]
    ) -> Float64[np.ndarray, "slot 64 3"]:
        """The contact points of targets at poses, world frame [m]."""
        return transform_points(poses, self.contacts[rows])


def outermost(points: Float[np.ndarray, "*n point 3"]) -> Float32[np.ndarray, "*n 48 3"]:
    """Of the points of each surface the one that lies furthest in each of the directions, in their order."""
    furthest = (points @ _DIRECTIONS.T).argmax(axis=-2)
    return np.take_along_axis(points, furthest[..., None], axis=-2).astype(np.float32)


def _spread_directions(count: int) -> Float64[np.ndarray, "direction 3"]:
    """Unit vectors spread evenly over the sphere, on a spiral by the golden angle."""
    number = np.arange(count) + 0.5
    polar, around = np.arccos(1 - 2 * number / count), np.pi * (1 + np.sqrt(5)) * number
    return np.column_stack([np.cos(around) * np.sin(polar), np.sin(around) * np.sin(polar), np.cos(polar)])


_DIRECTIONS: Final = _spread_directions(SURFACE_POINTS)
