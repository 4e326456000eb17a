"""The Asset: one reusable object with everything a scene, a renderer and a policy need.

The object frame has its origin at the centre of mass and is metric. An asset's identity is the hash of its content.
"""

import hashlib
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Float32, Float64, Int32

from clutter6d.schema import canonical_json

SURFACE_POINTS = 512
MAX_STABLE_ORIENTATIONS = 64
LARGE_EXTENT_M = (0.25, 0.35)
SMALL_EXTENT_M = (0.06, 0.25)

Provenance = Literal["source", "rule", "declared", "vlm", "person"]
"""Where an attribute's value came from: the source's metadata, a rule, the family's author, a model, a person."""

SizeClass = Literal["large", "small"]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Mesh:
    """A triangle mesh in the object frame."""

    vertices: Float32[np.ndarray, "vertex 3"]
    faces: Int32[np.ndarray, "face 3"]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class VisualMesh:
    """The triangles of one colour; RGBA in [0, 1]."""

    mesh: Mesh
    rgba: tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StableOrientations:
    """Resting orientations on a horizontal table, most probable first, each verified in simulation.

    Attributes:
        quats_wxyz: Object frame to world frame.
        heights_m: Height of the object's origin above the table at rest.
        probabilities: Share of random drops that end in each, among those kept.
    """

    quats_wxyz: Float64[np.ndarray, "pose 4"]
    heights_m: Float64[np.ndarray, "pose"]
    probabilities: Float64[np.ndarray, "pose"]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class MassProperties:
    """Mass, and inertia about the centre of mass in the object frame [kg m^2]."""

    mass_kg: float
    inertia: Float64[np.ndarray, "3 3"]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SymmetryGroup:
    """Rotations that leave the object's shape unchanged (BOP convention).

    Attributes:
        discrete_quats_wxyz: A finite set of rotations; the first is the identity.
        continuous_axis: Unit axis of full rotational symmetry, or ``None``.
    """

    discrete_quats_wxyz: Float64[np.ndarray, "rotation 4"]
    continuous_axis: tuple[float, float, float] | None


@dataclass(frozen=True, kw_only=True, slots=True)
class Attributes:
    """Semantic attributes, each with where it came from."""

    category: str
    colour: str
    material: str
    friction: float
    category_from: Provenance
    colour_from: Provenance
    material_from: Provenance
    mass_from: Provenance
    friction_from: Provenance


@dataclass(frozen=True, kw_only=True, slots=True)
class Licence:
    """Under which terms, by whom and from where an object came; travels with it everywhere."""

    name: str
    author: str
    source: str
    source_id: str
    url: str = ""


@dataclass(frozen=True, kw_only=True, slots=True)
class Quality:
    """What processing did to the shape, and what it cost.

    Attributes:
        source_vertices: Vertices of the input mesh.
        source_watertight: Whether the input mesh was watertight.
        parts: Convex parts.
        part_vertices: Vertices of all parts.
        volume_ratio: Volume of the parts' union over the volume of the repaired mesh.
        hull_volume_ratio: Summed volume of the parts over the volume of the convex hull.
        hausdorff_m: Symmetric Hausdorff distance between the repaired mesh's solid and the parts' union.
        stable_candidates: Stable orientations proposed by geometry.
        stable_verified: Those that held in simulation.
        seconds: Processor time of each stage, on one core.
        fallbacks: Every step that did not go the normal way, in order.
    """

    source_vertices: int
    source_watertight: bool
    parts: int
    part_vertices: int
    volume_ratio: float
    hull_volume_ratio: float
    hausdorff_m: float
    stable_candidates: int
    stable_verified: int
    seconds: dict[str, float]
    fallbacks: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Asset:
    """One object, ready to be placed in a scene.

    Attributes:
        name: Human-readable name, for instance ``"mug-0003"``; unique within a library.
        content_hash: SHA-256 over shape, mass, poses, points and attributes; the asset's identity.
        visual: What a renderer shows.
        parts: Convex collision parts, each one hull.
        mass_properties: Mass and inertia.
        stable: Verified stable orientations; at least one.
        surface_points: 512 canonical points sampled uniformly on the visual surface (paper, "Sampling and Filtering").
        symmetry: Rotations that leave the shape unchanged.
        extents_m: Side lengths of the object-frame bounding box.
        attributes: Semantic attributes.
        licence: Terms and origin.
        quality: Processing report.
    """

    name: str
    content_hash: str
    visual: tuple[VisualMesh, ...]
    parts: tuple[Mesh, ...]
    mass_properties: MassProperties
    stable: StableOrientations
    surface_points: Float32[np.ndarray, "512 3"]
    symmetry: SymmetryGroup
    extents_m: tuple[float, float, float]
    attributes: Attributes
    licence: Licence
    quality: Quality

    @property
    def longest_extent_m(self) -> float:
        """The longest side of the object-frame bounding box."""
        return max(self.extents_m)

    @property
    def size_class(self) -> SizeClass | None:
        """``large``, ``small``, or ``None`` if outside both ranges (paper, Table "Difficulty levels")."""
        if LARGE_EXTENT_M[0] <= self.longest_extent_m <= LARGE_EXTENT_M[1]:
            return "large"
        if SMALL_EXTENT_M[0] <= self.longest_extent_m < SMALL_EXTENT_M[1]:
            return "small"
        return None


def content_hash(
    *,
    visual: tuple[VisualMesh, ...],
    parts: tuple[Mesh, ...],
    mass_properties: MassProperties,
    stable: StableOrientations,
    surface_points: Float[np.ndarray, "512 3"],
    symmetry: SymmetryGroup,
    attributes: Attributes,
    licence: Licence,
) -> str:
    """SHA-256 over everything that a scene's outcome, look or attribution depends on."""
    digest = hashlib.sha256()
    arrays: list[np.ndarray] = []
    for item in visual:
        arrays += [item.mesh.vertices, item.mesh.faces, np.array(item.rgba)]
    for part in parts:
        arrays += [part.vertices, part.faces]
    arrays += [mass_properties.inertia, stable.quats_wxyz, stable.heights_m, stable.probabilities]
    arrays += [surface_points, symmetry.discrete_quats_wxyz]
    for array in arrays:
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    described = [
        [len(visual), len(parts), mass_properties.mass_kg, symmetry.continuous_axis],
        [getattr(attributes, name) for name in Attributes.__slots__],
        [getattr(licence, name) for name in Licence.__slots__],
    ]
    digest.update(canonical_json(described))
    return digest.hexdigest()


def hash_asset(asset: Asset) -> str:
    """The content hash that an asset must have, whatever it says of itself."""
    return content_hash(
        visual=asset.visual,
        parts=asset.parts,
        mass_properties=asset.mass_properties,
        stable=asset.stable,
        surface_points=asset.surface_points,
        symmetry=asset.symmetry,
        attributes=asset.attributes,
        licence=asset.licence,
    )
