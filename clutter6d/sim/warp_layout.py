"""The one model that all worlds of a track share on the device, and what each world sets for itself.

MuJoCo Warp simulates worlds of one structure: the same bodies, joints and geoms. The shared model therefore has room
for as many parts as an asset may have in each object, and a world leaves the geoms that its assets do not need without
a mesh (``geom_dataid`` -1), which takes them out of the collision test.
"""

from typing import Final

import mujoco
import numpy as np
from jaxtyping import Int

from clutter6d.assets.asset import Mesh
from clutter6d.assets.decomposition import MAX_PARTS
from clutter6d.assets.mujoco_body import add_mesh
from clutter6d.physics import OBJECT_CONTACT
from clutter6d.sim.scene_model import SceneModel, build_scene_spec

GEOM_FIELDS: Final = (
    "geom_size",
    "geom_aabb",
    "geom_rbound",
    "geom_pos",
    "geom_quat",
    "geom_friction",
)
BODY_FIELDS: Final = (
    "body_mass",
    "body_subtreemass",
    "body_inertia",
    "body_invweight0",
    "body_ipos",
    "body_iquat",
)
WORLD_FIELDS: Final = ("geom_dataid", *GEOM_FIELDS, *BODY_FIELDS, "dof_invweight0")
"""What a world sets for itself, by MuJoCo's names; everything else is the same in all worlds of a batch."""

_NO_MESH: Final = -1
_TETRAHEDRON = Mesh(
    vertices=np.array([[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]], dtype=np.float32),
    faces=np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], dtype=np.int32),
)

WorldRow = dict[str, np.ndarray]
"""A world's own values by name, each without the leading world axis."""


class WorldLayout:
    """The structure that all scenes with as many objects share.

    Args:
        object_count: Number of objects.

    Attributes:
        model: The shared model, with placeholders where worlds differ.
    """

    def __init__(self, object_count: int) -> None:
        self.model = _compile_placeholders(object_count)
        self.object_count = object_count
        self._first_body = self.model.nbody - object_count
        self._first_geom = int(self.model.body_geomadr[self._first_body])

    @property
    def object_bodies(self) -> slice:
        """The objects' bodies in the shared model."""
        return slice(self._first_body, self.model.nbody)

    @property
    def object_geoms(self) -> slice:
        """Each object's first geom in the shared model."""
        return slice(self._first_geom, self.model.ngeom, MAX_PARTS)

    def row(self, scene: SceneModel, mesh_ids: list[Int[np.ndarray, "_"]]) -> WorldRow:
        """What a scene sets for itself.

        Args:
            scene: The scene.
            mesh_ids: Of each object's parts.
        """
        source, target = self._matching_geoms(scene)
        row: WorldRow = {"geom_dataid": np.full(self.model.ngeom, _NO_MESH, dtype=np.int32)}
        row["geom_dataid"][target[self._first_geom :]] = np.concatenate(mesh_ids)
        for name in GEOM_FIELDS:
            row[name] = np.array(getattr(self.model, name))
            row[name][target] = getattr(scene.model, name)[source]
        for name in BODY_FIELDS:
            row[name] = getattr(scene.model, name)[: self.model.nbody]
        row["dof_invweight0"] = scene.model.dof_invweight0
        return row

    def first_geoms(self, scene: SceneModel) -> Int[np.ndarray, "object"]:
        """The first geom of each object in the scene's own model."""
        return scene.model.body_geomadr[self._first_body : self.model.nbody]

    def _matching_geoms(self, scene: SceneModel) -> tuple[Int[np.ndarray, "geom"], Int[np.ndarray, "geom"]]:
        """Geoms of the scene's model, and the geoms of the shared model that stand for them."""
        fixed = np.arange(self._first_geom)
        source, target = [fixed], [fixed]
        for number, (first, asset) in enumerate(zip(self.first_geoms(scene), scene.assets, strict=True)):
            parts = np.arange(len(asset.parts))
            source.append(first + parts)
            target.append(self._first_geom + number * MAX_PARTS + parts)
        return np.concatenate(source), np.concatenate(target)


def _compile_placeholders(object_count: int) -> mujoco.MjModel:
    spec = build_scene_spec([])
    add_mesh(spec, "placeholder", _TETRAHEDRON)
    contype, conaffinity = OBJECT_CONTACT
    for number in range(object_count):
        body = spec.worldbody.add_body(name=f"object_{number}")
        body.add_freejoint()
        body.explicitinertial, body.simple, body.mass = True, False, 1.0
        body.fullinertia = (0.01, 0.01, 0.01, 0.0, 0.0, 0.0)
        for _ in range(MAX_PARTS):
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_MESH,
                meshname="placeholder",
                mass=0,
                contype=contype,
                conaffinity=conaffinity,
            )
    return spec.compile()
