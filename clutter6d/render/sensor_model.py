"""A scene as cameras see it: robot, table, objects with their visual meshes, surroundings, and what each geom is."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np
from jaxtyping import UInt8

from clutter6d.assets.asset import Asset
from clutter6d.render.studio import TABLE_LEGS, add_studio
from clutter6d.sim.model_variation import set_table_height, table_height_m
from clutter6d.sim.scene_model import build_scene_spec

BACKGROUND: Final = 0
TABLE: Final = 1
ROBOT: Final = 2
TARGET: Final = 3
"""Labels of a segmentation; the obstacles follow the target in the scene's order."""

_NO_SHADOWS: Final = 0
"""Size of the shadow map [px]; shadows would take four times as long as everything else."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SensorModel:
    """What cameras see of a scene.

    Attributes:
        model: For drawing; ``qpos`` is laid out as the simulator's.
        labels: Segmentation label of each geom.
    """

    model: mujoco.MjModel
    labels: UInt8[np.ndarray, "geom"]

    def raise_table(self, height_m: float) -> bool:
        """Bring the table's top to a height [m] and its legs with it; returns whether it was elsewhere."""
        lift = height_m - table_height_m(self.model)
        if lift == 0:
            return False
        set_table_height(self.model, height_m)
        for name in TABLE_LEGS:
            leg = self.model.geom(name)
            leg.size[2] += lift / 2
            leg.pos[2] += lift / 2
        return True


def make_sensor_model(objects: Sequence[tuple[str, Asset]]) -> SensorModel:
    """Compile what cameras see of placed objects, the target first."""
    spec = build_scene_spec(objects, visuals=True)
    add_studio(spec)
    spec.visual.quality.shadowsize = _NO_SHADOWS
    model = spec.compile()
    return SensorModel(model=model, labels=_label_geoms(model, [name for name, _ in objects]))


def _label_geoms(model: mujoco.MjModel, names: Sequence[str]) -> UInt8[np.ndarray, "geom"]:
    """The robot is every body that moves and is no object, and its base."""
    of_body = np.full(model.nbody, ROBOT, dtype=np.uint8)
    of_body[0] = BACKGROUND
    for index, name in enumerate(names):
        of_body[model.body(name).id] = TARGET + index
    labels = of_body[model.geom_bodyid]
    for name in ("table", *TABLE_LEGS):
        labels[model.geom(name).id] = TABLE
    return labels
