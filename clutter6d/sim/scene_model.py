"""From placed assets to MuJoCo models that can run side by side in one batch.

``mujoco.batch`` runs every simulation on a model of its own if all models give ``MjData`` the same layout: the same
bodies, joints and number of geoms, and the same number of bounding-volume nodes. Every model of a track is therefore
padded with geoms that cannot collide and with unreferenced triangle strips, to sizes that depend on the track alone;
so a scene's physics never depends on its neighbours in a batch.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float64

from clutter6d.assets.asset import Asset, Mesh
from clutter6d.assets.decomposition import MAX_PART_VERTICES, MAX_PARTS
from clutter6d.assets.mujoco_body import add_asset_body, add_mesh
from clutter6d.errors import InvalidValueError
from clutter6d.physics import add_table, apply_physics_options
from clutter6d.scene import TABLE_SIZE_M, Scene
from clutter6d.sim.robot import HOME_QPOS, JOINT_NAMES, add_robot

ARM_DOF = len(JOINT_NAMES)
ARENA_BYTES = 16 << 20
_STRIP_TRIANGLES_MIN = 2


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SceneModel:
    """A compiled scene. ``qpos`` is 7 arm joints, then 7 numbers (position, ``wxyz``) for each object in order.

    Attributes:
        model: The padded MuJoCo model.
        names: Names of the objects.
        assets: Their assets, in the same order.
    """

    model: mujoco.MjModel
    names: tuple[str, ...]
    assets: tuple[Asset, ...]

    @property
    def object_count(self) -> int:
        """Number of placed objects."""
        return len(self.names)

    def object_body_ids(self) -> np.ndarray:
        """Body id of each object."""
        return np.array([self.model.body(name).id for name in self.names])

    def object_masses_kg(self) -> Float64[np.ndarray, "object"]:
        """Mass of each object, as it is simulated [kg]."""
        return self.model.body_mass[self.object_body_ids()]

    def object_frictions(self) -> Float64[np.ndarray, "object"]:
        """Sliding friction of each object, as it is simulated; all parts of an object have the same."""
        return self.model.geom_friction[self.model.body_geomadr[self.object_body_ids()], 0]


def build_scene_spec(objects: Sequence[tuple[str, Asset]], *, visuals: bool = False) -> mujoco.MjSpec:
    """Table, robot and objects, objects at the origin.

    Args:
        objects: Name and asset of each object, in the order of ``qpos``.
        visuals: Whether to add what only a renderer needs.
    """
    spec = mujoco.MjSpec()
    apply_physics_options(spec)
    spec.memory = ARENA_BYTES
    add_table(spec, TABLE_SIZE_M)
    add_robot(spec, visuals=visuals)
    for name, asset in objects:
        add_asset_body(spec, asset, name=name, visuals=visuals)
    return spec


def compile_scene(objects: Sequence[tuple[str, Asset]]) -> SceneModel:
    """Compile placed assets into a model of the layout that all scenes with as many objects share.

    Raises:
        InvalidValueError: An asset has more parts or vertices than the layout allows.
    """
    for name, asset in objects:
        vertices = max(len(part.vertices) for part in asset.parts)
        if len(asset.parts) > MAX_PARTS or vertices > MAX_PART_VERTICES:
            raise InvalidValueError(
                f"object '{name}': asset {asset.name} has {len(asset.parts)} parts of up to {vertices} vertices; "
                f"a scene allows {MAX_PARTS} of {MAX_PART_VERTICES}; process it again with these limits"
            )
    spec = build_scene_spec(objects)
    _pad_geoms(spec, len(objects) * MAX_PARTS - sum(len(asset.parts) for _, asset in objects))
    model = _compile_with_nodes(spec, _node_budget(len(objects)))
    return SceneModel(model=model, names=tuple(n for n, _ in objects), assets=tuple(a for _, a in objects))


def compile_stored_scene(scene: Scene, assets: Mapping[str, Asset]) -> SceneModel:
    """Compile a scene, with its assets given by content hash."""
    return compile_scene([(item.name, assets[item.asset_hash]) for item in scene.objects])


def joint_state(
    object_poses: Float64[np.ndarray, "*n object 7"], arm_qpos: Float64[np.ndarray, "7"] | None = None
) -> Float64[np.ndarray, "*n qpos"]:
    """``qpos`` rows from object poses, with the arm at ``arm_qpos`` (default: home)."""
    flat = object_poses.reshape(*object_poses.shape[:-2], -1)
    arm = np.broadcast_to(HOME_QPOS if arm_qpos is None else arm_qpos, (*flat.shape[:-1], ARM_DOF))
    return np.concatenate([arm, flat], axis=-1)


def motion_in_states(
    states: Float64[np.ndarray, "*n state"], object_count: int
) -> tuple[Float64[np.ndarray, "*n qpos"], Float64[np.ndarray, "*n qvel"]]:
    """``qpos`` and ``qvel`` in full integration states, which begin with the time; views.

    Args:
        states: Rows laid out as ``SceneBatch.states``.
        object_count: Placed objects of the scenes.
    """
    velocities_at = 1 + ARM_DOF + 7 * object_count
    end = velocities_at + ARM_DOF + 6 * object_count
    return states[..., 1:velocities_at], states[..., velocities_at:end]


def _node_budget(object_count: int) -> int:
    """Bounding-volume nodes that any scene of so many objects stays under: 2n - 1 for n faces, hulls have 2v - 4."""
    per_part = 2 * (2 * MAX_PART_VERTICES - 4) - 1
    bodies_and_table = 2 * (object_count * (MAX_PARTS + 1) + 64)
    return object_count * MAX_PARTS * per_part + bodies_and_table


def _pad_geoms(spec: mujoco.MjSpec, count: int) -> None:
    body = spec.worldbody.add_body(name="layout_padding", pos=(0, 0, -1))
    for _ in range(count):
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(0.001, 0, 0), contype=0, conaffinity=0, mass=0, group=5)


def _compile_with_nodes(spec: mujoco.MjSpec, nodes: int) -> mujoco.MjModel:
    """Compile with unreferenced strips that bring ``nbvh`` to exactly ``nodes``; a strip of n triangles adds 2n - 1."""
    model = spec.compile()
    missing = nodes - model.nbvh
    if missing == 0:
        return model
    odd_sizes = [missing] if missing % 2 else [2 * _STRIP_TRIANGLES_MIN - 1, missing - 2 * _STRIP_TRIANGLES_MIN + 1]
    for index, size in enumerate(odd_sizes):
        _add_strip(spec, f"layout_padding_{index}", (size + 1) // 2)
    return spec.compile()


def _add_strip(spec: mujoco.MjSpec, name: str, triangles: int) -> None:
    index = np.arange(triangles + 2)
    vertices = np.stack([0.01 * index, 0.01 * (index % 2), 0.001 * (index % 3)], axis=1).astype(np.float32)
    faces = np.stack([index[:-2], index[1:-1], index[2:]], axis=1).astype(np.int32)
    add_mesh(spec, name, Mesh(vertices=vertices, faces=faces))
