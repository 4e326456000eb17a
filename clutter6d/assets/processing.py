"""One source object to one asset, start to end: size, solid, parts, mass, stable orientations, points, attributes."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import manifold3d
import numpy as np

from clutter6d.assets.asset import (
    Asset,
    MassProperties,
    Mesh,
    Quality,
    StableOrientations,
    SymmetryGroup,
    VisualMesh,
    hash_asset,
)
from clutter6d.assets.attributes import derive_attributes
from clutter6d.assets.decomposition import Decomposition, DecompositionSettings, Effort, decompose, measure_parts
from clutter6d.assets.given_parts import convex_hulls_of
from clutter6d.assets.mass_properties import integrate_manifold, is_inertia, scale_inertia
from clutter6d.assets.shape_preparation import (
    Soup,
    join_visuals,
    move_origin,
    scale_to_real_size,
    simplify_visuals,
)
from clutter6d.assets.solid import ClosedSolid, SolidSettings, close_solid
from clutter6d.assets.sources.base import AssetSource, RawShape, SourceObject
from clutter6d.assets.stable_poses import StablePoseSettings, find_stable_orientations
from clutter6d.assets.surface_points import sample_surface_points
from clutter6d.assets.symmetry import find_symmetries
from clutter6d.errors import MeshRejectedError
from clutter6d.executor import announce_stage
from clutter6d.seeding import generator

PROCESSING_VERSION = 5
"""Raised whenever the same input and settings give another asset; part of every library's settings."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ProcessingSettings:
    """Everything that an asset depends on, beside its source.

    Attributes:
        seed: Of surface points and of sizes drawn for objects of unknown unit.
        visual_faces: Triangles that a renderer gets.
        solid: How a soup becomes a solid.
        decomposition: Convex parts.
        stable_poses: Stable orientations.
        version: Of the processing code.
    """

    seed: int = 0
    visual_faces: int = 5000
    solid: SolidSettings = field(default_factory=SolidSettings)
    decomposition: DecompositionSettings = field(default_factory=DecompositionSettings)
    stable_poses: StablePoseSettings = field(default_factory=StablePoseSettings)
    version: int = PROCESSING_VERSION


class _Stages:
    """Announces each stage and keeps its processor time, which a busy machine does not stretch."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        announce_stage(name)
        start = time.process_time()
        yield
        self.seconds[name] = round(time.process_time() - start, 4)


def process_object(
    source: AssetSource, item: SourceObject, settings: ProcessingSettings, *, effort: Effort = "normal"
) -> Asset:
    """Make an asset of one source object. Bad meshes can crash the process: call it in a child (``run``).

    Args:
        source: Where the object comes from.
        item: The object.
        settings: How.
        effort: How hard to try at convex parts; less after a crash.

    Returns:
        The asset, its origin at the centre of mass.

    Raises:
        MeshRejectedError: It cannot become an asset; carries the reason.
    """
    stages = _Stages()
    with stages("load"):
        shape = source.load(item)
    with stages("solid"):
        source_vertices = sum(len(part.mesh.vertices) for part in shape.visual)
        shape = scale_to_real_size(item, shape, seed=settings.seed)
        solid = _closed_solid(shape, join_visuals(shape.visual), settings)
    with stages("decomposition"):
        parts = _convex_parts(shape, solid.manifold, settings, effort)
    with stages("mass"):
        volume, centre, inertia_per_kg, mass_fallbacks = _mass_distribution(shape, solid.manifold, parts)
    with stages("visual"):
        visual = simplify_visuals(shape.visual, settings.visual_faces)
        visual = tuple(replace(part, mesh=move_origin(part.mesh, centre)) for part in visual)
    with stages("attributes"):
        attributes, mass = derive_attributes(
            name=item.name,
            hints=item.hints,
            visual=visual,
            volume_m3=volume,
            hull_volume_m3=solid.manifold.hull().volume(),
        )
    with stages("symmetry"):
        symmetry = shape.symmetry or _symmetry(solid, centre, inertia_per_kg)
    quality = Quality(
        source_vertices=source_vertices,
        source_watertight=solid.was_watertight,
        parts=len(parts.parts),
        part_vertices=sum(len(part.vertices) for part in parts.parts),
        volume_ratio=parts.volume_ratio,
        hull_volume_ratio=parts.hull_volume_ratio,
        hausdorff_m=parts.hausdorff_m,
        stable_candidates=0,
        stable_verified=0,
        seconds={},
        fallbacks=(*solid.fallbacks, *parts.fallbacks, *mass_fallbacks),
    )
    draft = Asset(
        name=item.name,
        content_hash="",
        visual=visual,
        parts=tuple(move_origin(part, centre) for part in parts.parts),
        mass_properties=MassProperties(mass_kg=mass, inertia=scale_inertia(inertia_per_kg, mass)),
        stable=StableOrientations(quats_wxyz=np.zeros((0, 4)), heights_m=np.zeros(0), probabilities=np.zeros(0)),
        surface_points=sample_surface_points(visual, generator(settings.seed, "surface-points", item.key)),
        symmetry=symmetry,
        extents_m=_extents(visual),
        attributes=attributes,
        licence=item.licence,
        quality=quality,
    )
    with stages("stable_poses"):
        report = find_stable_orientations(draft, settings.stable_poses)
    quality = replace(
        quality,
        stable_candidates=report.candidates,
        stable_verified=len(report.stable.heights_m),
        seconds=stages.seconds,
        fallbacks=(*quality.fallbacks, *report.fallbacks),
    )
    return _sealed(replace(draft, stable=report.stable, quality=quality))


def _sealed(asset: Asset) -> Asset:
    """The asset under the hash of its content."""
    return replace(asset, content_hash=hash_asset(asset))


def _closed_solid(shape: RawShape, soup: Soup, settings: ProcessingSettings) -> ClosedSolid:
    try:
        return close_solid(soup.vertices, soup.faces, settings.solid)
    except MeshRejectedError:
        hulls = convex_hulls_of(shape.parts or ())
        if not hulls:
            raise
        union = manifold3d.Manifold.batch_boolean(hulls, manifold3d.OpType.Add)
        return ClosedSolid(manifold=union, was_watertight=False, fallbacks=("solid:from-parts",))


def _convex_parts(
    shape: RawShape, solid: manifold3d.Manifold, settings: ProcessingSettings, effort: Effort
) -> Decomposition:
    """The parts known from construction if they are what they should be, else found ones."""
    if shape.parts is None:
        return decompose(solid, settings.decomposition, effort=effort)
    hulls = convex_hulls_of(shape.parts)
    if hulls is None or len(hulls) > settings.decomposition.max_parts:
        found = decompose(solid, settings.decomposition, effort=effort)
        return replace(found, fallbacks=("parts:given-not-convex-or-too-many", *found.fallbacks))
    points = [part.vertices.astype(np.float64) for part in shape.parts]
    return measure_parts(solid, points, settings.decomposition, ())


def _mass_distribution(
    shape: RawShape, solid: manifold3d.Manifold, parts: Decomposition
) -> tuple[float, np.ndarray, np.ndarray, tuple[str, ...]]:
    """Volume, centre of mass and inertia per kilogram: from construction, else the solid, else the parts."""
    fallbacks: tuple[str, ...] = ()
    try:
        volume, centre, inertia = integrate_manifold(solid)
    except MeshRejectedError:
        hulls = convex_hulls_of(parts.parts) or []
        volume, centre, inertia = integrate_manifold(manifold3d.Manifold.batch_boolean(hulls, manifold3d.OpType.Add))
        fallbacks = ("mass:from-parts",)
    if shape.inertia_per_kg is not None and is_inertia(shape.inertia_per_kg) and shape.centre_of_mass_m is not None:
        centre, inertia = np.array(shape.centre_of_mass_m), shape.inertia_per_kg
    return shape.volume_m3 or volume, centre, inertia, fallbacks


def _symmetry(solid: ClosedSolid, centre: np.ndarray, inertia_per_kg: np.ndarray) -> SymmetryGroup:
    vertices, faces = solid.arrays()
    return find_symmetries(vertices - centre, faces, inertia_per_kg)


def _extents(visual: tuple[VisualMesh, ...]) -> tuple[float, float, float]:
    points = np.concatenate([_used_vertices(item.mesh) for item in visual])
    x, y, z = (float(side) for side in np.ptp(points, axis=0))
    return (x, y, z)


def _used_vertices(mesh: Mesh) -> np.ndarray:
    return mesh.vertices[np.unique(mesh.faces)]
