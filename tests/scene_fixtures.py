"""Small scenes of boxes, made in code, that every test of simulation, environments and evaluation can use."""

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from clutter6d.assets.asset import (
    Asset,
    Attributes,
    Licence,
    MassProperties,
    Mesh,
    Quality,
    StableOrientations,
    SymmetryGroup,
    VisualMesh,
    content_hash,
)
from clutter6d.geometry import Pose
from clutter6d.scene import TABLE, Certificate, GoalPair, PlacedObject, Relation, Scene, SceneGraph
from clutter6d.scenegen.scene_set import GenerationRecord, SceneSet, SceneSetFile
from clutter6d.seeding import generator
from clutter6d.sim.scene_model import SceneModel, compile_stored_scene

_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]],
    dtype=np.int32,
)  # fmt: skip
_HALF_TURNS = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=np.float64)
_ROOT_HALF = np.sqrt(0.5)
_RESTING = np.array([[1, 0, 0, 0], [_ROOT_HALF, _ROOT_HALF, 0, 0], [_ROOT_HALF, 0, _ROOT_HALF, 0]])


def make_box_asset(name: str, size_m: tuple[float, float, float], *, mass_kg: float = 0.3) -> Asset:
    """A solid box of uniform density: one part, three resting orientations, the symmetry of a box."""
    half = np.array(size_m) / 2
    mesh = Mesh(vertices=(_CORNERS * half).astype(np.float32), faces=_FACES)
    square = np.array(size_m) ** 2
    content = {
        "visual": (VisualMesh(mesh=mesh, rgba=(0.7, 0.5, 0.3, 1.0)),),
        "parts": (mesh,),
        "mass_properties": MassProperties(mass_kg=mass_kg, inertia=np.diag(mass_kg / 12 * (square.sum() - square))),
        "stable": StableOrientations(
            quats_wxyz=_RESTING.copy(), heights_m=half[[2, 1, 0]].copy(), probabilities=np.full(3, 1 / 3)
        ),
        "surface_points": _box_surface_points(name, half),
        "symmetry": SymmetryGroup(discrete_quats_wxyz=_HALF_TURNS.copy(), continuous_axis=None),
        "attributes": Attributes(
            category="box",
            colour="brown",
            material="cardboard",
            friction=0.5,
            category_from="declared",
            colour_from="declared",
            material_from="declared",
            mass_from="declared",
            friction_from="declared",
        ),
        "licence": Licence(name="Apache-2.0", author="Clutter6D", source="test", source_id=name),
    }
    quality = Quality(
        source_vertices=8,
        source_watertight=True,
        parts=1,
        part_vertices=8,
        volume_ratio=1.0,
        hull_volume_ratio=1.0,
        hausdorff_m=0.0,
        stable_candidates=3,
        stable_verified=3,
        seconds={},
        fallbacks=(),
    )
    return Asset(name=name, content_hash=content_hash(**content), extents_m=size_m, quality=quality, **content)


def _box_surface_points(name: str, half: np.ndarray) -> np.ndarray:
    rng = generator(0, "box", name)
    areas = np.array([half[1] * half[2], half[2] * half[0], half[0] * half[1]])
    axis = rng.choice(3, size=512, p=areas / areas.sum())
    points = rng.uniform(-1, 1, size=(512, 3))
    points[np.arange(512), axis] = rng.choice([-1.0, 1.0], size=512)
    return (points * half).astype(np.float32)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class BoxSceneSet:
    """Scenes of four boxes with two goal pairs each, in memory; offers what an evaluation needs of a scene set."""

    scenes: tuple[Scene, ...]
    assets: dict[str, Asset]
    sha256: str = field(default="b" * 64)

    def assets_of(self, scene: Scene) -> dict[str, Asset]:
        """The assets of a scene by content hash."""
        return {item.asset_hash: self.assets[item.asset_hash] for item in scene.objects}


TARGET_SIZE_M = (0.06, 0.09, 0.14)
OBSTACLE_SIZES_M = ((0.10, 0.26, 0.08), (0.08, 0.08, 0.12), (0.07, 0.12, 0.06))


def make_box_scene_set(scenes: int = 2) -> BoxSceneSet:
    """Scenes ``boxes-0`` ..., whose boxes differ in size and place; everything rests on the table exactly."""
    made = [_make_scene(index) for index in range(scenes)]
    assets = {asset.content_hash: asset for _, owned in made for asset in owned}
    return BoxSceneSet(scenes=tuple(scene for scene, _ in made), assets=assets)


def write_box_scene_set(path: Path, scenes: int = 2) -> SceneSet:
    """The same scenes as a folder on disk."""
    made = make_box_scene_set(scenes)
    header = SceneSetFile(track="sparse", seed=0, library_sha256="0" * 64, generator_version="test")
    stored = SceneSet.create(path, header)
    for scene in made.scenes:
        stored.add(scene, made.assets_of(scene), GenerationRecord(failures={}, seconds=0.0))
    return SceneSet.open(path)


def make_box_scene(index: int = 0) -> tuple[Scene, SceneModel]:
    """One scene and its compiled model."""
    scene, assets = _make_scene(index)
    return scene, compile_stored_scene(scene, {asset.content_hash: asset for asset in assets})


@cache
def _make_scene(index: int) -> tuple[Scene, list[Asset]]:
    names = ("target", "large_0", "small_0", "small_1")
    grown = 0.005 * index
    sizes = [TARGET_SIZE_M, *OBSTACLE_SIZES_M]
    assets = [
        make_box_asset(f"{name}-{index}", (size[0] + grown, size[1], size[2]))
        for name, size in zip(names, sizes, strict=True)
    ]
    roles = ("target", "large", "small", "small")
    objects = tuple(
        PlacedObject(name=name, asset_name=asset.name, asset_hash=asset.content_hash, role=role, stable_index=0)
        for name, asset, role in zip(names, assets, roles, strict=True)
    )
    graph = SceneGraph(
        objects=names, relations=tuple(Relation(kind="on", subject=name, reference=TABLE) for name in names)
    )
    scene = Scene(
        scene_id=f"boxes-{index}",
        track="sparse",
        seed=0,
        index=index,
        objects=objects,
        graph=graph,
        goal_pairs=tuple(_make_pair(index, number) for number in range(2)),
        certificate=Certificate(
            max_penetration_m=0.0,
            max_drift_m=0.0,
            max_drift_rad=0.0,
            relations_hold=4,
            reachable_poses=4,
            engine_version="test",
            generator_version="test",
        ),
    )
    return scene, assets


def _make_pair(index: int, number: int) -> GoalPair:
    """Pair 0 slides the target 0.2 m and keeps its face; pair 1 also lays it on its side."""
    start = Pose(position=(-0.05, -0.10 + 0.01 * index, 0.07), quat_wxyz=(1.0, 0.0, 0.0, 0.0))
    quat = _RESTING[number]
    height = (0.07, 0.045)[number]
    goal = Pose.from_row(np.array([-0.05, 0.10, height, *(quat / np.linalg.norm(quat))]))
    rows = [
        start.as_row(),
        np.array([0.15, 0.0, 0.04, 1, 0, 0, 0]),
        np.array([-0.10, -0.30, 0.06, 1, 0, 0, 0]),
        np.array([0.05, 0.30, 0.03, 1, 0, 0, 0]),
    ]
    return GoalPair(
        initial=start,
        goal=goal,
        object_poses=np.stack(rows),
        initial_stable_index=0,
        goal_stable_index=number,
        is_path_blocked=False,
        changes_resting_face=number == 1,
    )
