"""A placed scene before its goal pairs are known."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from clutter6d.assets.asset import Asset
from clutter6d.scene import PlacedObject, Role, SceneGraph
from clutter6d.scenegen.footprint import Layout
from clutter6d.scenegen.placement import Placed


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Draft:
    """Obstacles in place, the target still in hand.

    Attributes:
        names: The target, then the obstacles.
        assets: The asset of each object, by its name in the scene.
        hulls: Their hull points.
        graph: What should hold.
        obstacles: Where each obstacle was put.
        layout: The obstacles seen from above.
    """

    names: tuple[str, ...]
    assets: Mapping[str, Asset]
    hulls: Mapping[str, Float64[np.ndarray, "_ 3"]]
    graph: SceneGraph
    obstacles: Mapping[str, Placed]
    layout: Layout

    def states(self, target_poses: Float64[np.ndarray, "state 7"]) -> Float64[np.ndarray, "state object 7"]:
        """Poses of all objects with the target in each of several poses."""
        obstacles = np.array([self.obstacles[name].pose for name in self.names[1:]])
        repeated = np.broadcast_to(obstacles, (len(target_poses), *obstacles.shape))
        return np.concatenate([target_poses[:, None], repeated], axis=1)

    def placed_objects(self, target_stable_index: int) -> tuple[PlacedObject, ...]:
        """All objects as a scene lists them; the target's orientation is that of the first goal pair."""
        indices = {"target": target_stable_index} | {name: put.stable_index for name, put in self.obstacles.items()}
        return tuple(
            PlacedObject(
                name=name,
                asset_name=self.assets[name].name,
                asset_hash=self.assets[name].content_hash,
                role=_role(name),
                stable_index=indices[name],
            )
            for name in self.names
        )


def _role(name: str) -> Role:
    if name == "target":
        return "target"
    return "large" if name.startswith("large") else "small"
