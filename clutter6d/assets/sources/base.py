"""What an asset source is: a list of objects, and a way to load each one's shape."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float64

from clutter6d.assets.asset import Licence, Mesh, SymmetryGroup, VisualMesh


@dataclass(frozen=True, kw_only=True, slots=True)
class AttributeHints:
    """What a source knows of an object; ``None`` where it knows nothing and a rule decides."""

    category: str | None = None
    colour: str | None = None
    material: str | None = None
    mass_kg: float | None = None
    friction: float | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class SourceObject:
    """One object as its source lists it, before any geometry is read; picklable and small.

    Attributes:
        key: Identifies the object within its source, for ever.
        name: Human-readable slug; becomes the asset's name.
        licence: Terms and origin.
        hints: What the source knows about the object.
        extents_m: Real side lengths along the axes of the loaded shape, or ``None`` if the shape's own size is the
            real one or unknown.
        is_metric: Whether a shape without ``extents_m`` comes in metres; if not, it is scaled to a tabletop size.
    """

    key: str
    name: str
    licence: Licence
    hints: AttributeHints = field(default_factory=AttributeHints)
    extents_m: tuple[float, float, float] | None = None
    is_metric: bool = True


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class RawShape:
    """A shape as loaded, z up; any position; the unit is metres only if the source says so.

    Attributes:
        visual: Triangles by colour; as bad as the source's mesh is.
        parts: Convex parts where they are known from construction, else ``None``.
        volume_m3: Volume of the solid material where it is known from construction.
        centre_of_mass_m: Centre of mass where it is known from construction, in the shape's frame.
        inertia_per_kg: Inertia about the centre of mass for a mass of 1 kg [m^2], where it is known.
        symmetry: Symmetries declared by construction, about the centre of mass.
    """

    visual: tuple[VisualMesh, ...]
    parts: tuple[Mesh, ...] | None = None
    volume_m3: float | None = None
    centre_of_mass_m: tuple[float, float, float] | None = None
    inertia_per_kg: Float64[np.ndarray, "3 3"] | None = None
    symmetry: SymmetryGroup | None = None


@runtime_checkable
class AssetSource(Protocol):
    """A named collection of objects. To add one, implement this and register it under ``clutter6d.asset_sources``."""

    @property
    def name(self) -> str:
        """The source's name on the command line."""
        ...

    def objects(self) -> Sequence[SourceObject]:
        """All objects, in a fixed order; reads metadata only."""
        ...

    def fingerprint(self, item: SourceObject) -> str:
        """Hash of everything that the loaded shape depends on; the key of the processing cache."""
        ...

    def load(self, item: SourceObject) -> RawShape:
        """Read or build the shape; runs in a child process with limits, and may fail in any way."""
        ...
