"""How an asset is stored: ``asset.json`` for what is said, ``geometry.npz`` for what is measured."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from clutter6d.assets.asset import (
    SURFACE_POINTS,
    Asset,
    Attributes,
    Licence,
    MassProperties,
    Mesh,
    Provenance,
    Quality,
    SizeClass,
    StableOrientations,
    SymmetryGroup,
    VisualMesh,
    hash_asset,
)
from clutter6d.errors import InvalidFileError
from clutter6d.schema import ArraySpec, FileModel, array_bytes, read_arrays, read_model, write_bytes, write_model

JSON_NAME = "asset.json"
ARRAYS_NAME = "geometry.npz"
GEOMETRY = {
    "visual_vertices": ArraySpec(dtype="f4", shape=(None, 3)),
    "visual_faces": ArraySpec(dtype="i4", shape=(None, 3)),
    "visual_counts": ArraySpec(dtype="i4", shape=(None, 2)),
    "visual_rgba": ArraySpec(dtype="f8", shape=(None, 4)),
    "part_vertices": ArraySpec(dtype="f4", shape=(None, 3)),
    "part_faces": ArraySpec(dtype="i4", shape=(None, 3)),
    "part_counts": ArraySpec(dtype="i4", shape=(None, 2)),
    "inertia": ArraySpec(dtype="f8", shape=(3, 3)),
    "stable_quats_wxyz": ArraySpec(dtype="f8", shape=(None, 4)),
    "stable_heights_m": ArraySpec(dtype="f8", shape=(None,)),
    "stable_probabilities": ArraySpec(dtype="f8", shape=(None,)),
    "surface_points": ArraySpec(dtype="f4", shape=(SURFACE_POINTS, 3)),
    "symmetry_quats_wxyz": ArraySpec(dtype="f8", shape=(None, 4)),
}
"""The arrays of an asset, with their types and shapes."""


class AttributesModel(FileModel):
    """Stored attributes."""

    category: str
    colour: str
    material: str
    friction: float = Field(gt=0, le=4)
    category_from: Provenance
    colour_from: Provenance
    material_from: Provenance
    mass_from: Provenance
    friction_from: Provenance


class LicenceModel(FileModel):
    """Stored licence."""

    name: str
    author: str
    source: str
    source_id: str
    url: str = ""


class QualityModel(FileModel):
    """Stored processing report."""

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


class AssetFile(FileModel):
    """``asset.json``."""

    schema_version: Literal[1] = 1
    name: str = Field(pattern=r"^[a-z0-9][a-z0-9._-]{0,95}$")
    content_hash: str = Field(pattern=r"^[0-9a-f]{64}$")
    size_class: SizeClass | None
    extents_m: tuple[float, float, float]
    mass_kg: float = Field(gt=0)
    continuous_axis: tuple[float, float, float] | None
    attributes: AttributesModel
    licence: LicenceModel
    quality: QualityModel


@dataclass(frozen=True, kw_only=True, slots=True)
class PackedAsset:
    """An asset as its two files: packed by whoever makes it, so that storing it costs little.

    Attributes:
        description: Content of ``asset.json``.
        geometry: Bytes of ``geometry.npz``.
    """

    description: AssetFile
    geometry: bytes


def pack_asset(asset: Asset) -> PackedAsset:
    """An asset as its two files."""
    return PackedAsset(description=describe_asset(asset), geometry=array_bytes(asset_geometry(asset)))


def write_asset(folder: Path, asset: Asset | PackedAsset) -> None:
    """Store an asset; ``asset.json`` is written last, so a folder that has it is whole.

    Raises:
        StorageError: The disk is full or the folder cannot be written.
    """
    packed = asset if isinstance(asset, PackedAsset) else pack_asset(asset)
    write_bytes(folder / ARRAYS_NAME, packed.geometry)
    write_model(folder / JSON_NAME, packed.description)


def describe_asset(asset: Asset) -> AssetFile:
    """What is said of an asset, as stored."""
    return AssetFile(
        name=asset.name,
        content_hash=asset.content_hash,
        size_class=asset.size_class,
        extents_m=asset.extents_m,
        mass_kg=asset.mass_properties.mass_kg,
        continuous_axis=asset.symmetry.continuous_axis,
        attributes=AttributesModel(**_slots(asset.attributes)),
        licence=LicenceModel(**_slots(asset.licence)),
        quality=QualityModel(**_slots(asset.quality)),
    )


def read_asset_file(folder: Path) -> AssetFile:
    """Read ``asset.json`` alone.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is not a valid asset file.
    """
    return read_model(folder / JSON_NAME, AssetFile, what="asset file")


def read_asset(folder: Path) -> Asset:
    """Read an asset and check that its content is what its hash says.

    Raises:
        MissingFileError: A file is missing.
        InvalidFileError: A file is damaged, or the content does not have the stated hash.
    """
    file = read_asset_file(folder)
    arrays = read_arrays(folder / ARRAYS_NAME, GEOMETRY, what="asset geometry")
    return assemble_asset(folder / ARRAYS_NAME, file, arrays)


def asset_geometry(asset: Asset) -> dict[str, np.ndarray]:
    """What is measured of an asset, as stored: arrays as :data:`GEOMETRY` describes them."""
    visual = [item.mesh for item in asset.visual]
    return {
        **_stack("visual", visual),
        "visual_rgba": np.array([item.rgba for item in asset.visual], dtype=np.float64).reshape(-1, 4),
        **_stack("part", asset.parts),
        "inertia": asset.mass_properties.inertia,
        "stable_quats_wxyz": asset.stable.quats_wxyz,
        "stable_heights_m": asset.stable.heights_m,
        "stable_probabilities": asset.stable.probabilities,
        "surface_points": asset.surface_points,
        "symmetry_quats_wxyz": asset.symmetry.discrete_quats_wxyz,
    }


def _stack(prefix: str, meshes: Sequence[Mesh]) -> dict[str, np.ndarray]:
    return {
        f"{prefix}_vertices": np.concatenate([mesh.vertices for mesh in meshes]).astype(np.float32),
        f"{prefix}_faces": np.concatenate([mesh.faces for mesh in meshes]).astype(np.int32),
        f"{prefix}_counts": np.array([[len(mesh.vertices), len(mesh.faces)] for mesh in meshes], dtype=np.int32),
    }


def _unstack(path: Path, arrays: Mapping[str, np.ndarray], prefix: str) -> tuple[Mesh, ...]:
    vertices, faces, counts = (arrays[f"{prefix}_{kind}"] for kind in ("vertices", "faces", "counts"))
    if not len(counts) or (counts <= 0).any() or tuple(counts.sum(axis=0)) != (len(vertices), len(faces)):
        raise InvalidFileError(path, f"the counts of its {prefix} meshes do not add up")
    ends = np.cumsum(counts, axis=0)[:-1]
    meshes = zip(np.split(vertices, ends[:, 0]), np.split(faces, ends[:, 1]), strict=True)
    result = tuple(Mesh(vertices=v, faces=f) for v, f in meshes)
    if any(mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices) for mesh in result):
        raise InvalidFileError(path, f"a face of its {prefix} meshes names a vertex that is not there")
    return result


def assemble_asset(path: Path, file: AssetFile, arrays: Mapping[str, np.ndarray]) -> Asset:
    """The asset of a description and its geometry.

    Args:
        path: The file of the geometry, for messages.
        file: The description.
        arrays: The geometry, as :data:`GEOMETRY` describes it.

    Raises:
        InvalidFileError: The geometry is inconsistent, or the content does not have the stated hash.
    """
    asset = _assemble(path, file, arrays)
    found = hash_asset(asset)
    if found != file.content_hash:
        problem = f"{file.name}: content has hash {found[:12]}, the file says {file.content_hash[:12]}"
        raise InvalidFileError(path, f"{problem}; process the object again")
    return asset


def _assemble(path: Path, file: AssetFile, arrays: Mapping[str, np.ndarray]) -> Asset:
    visual, rgba = _unstack(path, arrays, "visual"), arrays["visual_rgba"]
    poses = {len(arrays[f"stable_{kind}"]) for kind in ("quats_wxyz", "heights_m", "probabilities")}
    if len(visual) != len(rgba) or len(poses) != 1 or poses == {0}:
        raise InvalidFileError(path, "colours or stable orientations are missing")
    return Asset(
        name=file.name,
        content_hash=file.content_hash,
        visual=tuple(VisualMesh(mesh=m, rgba=_rgba(c)) for m, c in zip(visual, rgba, strict=True)),
        parts=_unstack(path, arrays, "part"),
        mass_properties=MassProperties(mass_kg=file.mass_kg, inertia=arrays["inertia"]),
        stable=StableOrientations(
            quats_wxyz=arrays["stable_quats_wxyz"],
            heights_m=arrays["stable_heights_m"],
            probabilities=arrays["stable_probabilities"],
        ),
        surface_points=arrays["surface_points"],
        symmetry=SymmetryGroup(discrete_quats_wxyz=arrays["symmetry_quats_wxyz"], continuous_axis=file.continuous_axis),
        extents_m=file.extents_m,
        attributes=Attributes(**file.attributes.model_dump()),
        licence=Licence(**file.licence.model_dump()),
        quality=Quality(**file.quality.model_dump()),
    )


def _rgba(row: np.ndarray) -> tuple[float, float, float, float]:
    red, green, blue, alpha = (float(value) for value in row)
    return (red, green, blue, alpha)


def _slots(item: Any) -> dict[str, Any]:
    return {field.name: getattr(item, field.name) for field in fields(item)}
