"""Mass, centre of mass and inertia of a closed solid of even density."""

import manifold3d
import numpy as np
import trimesh
from jaxtyping import Float, Float64, Int

from clutter6d.assets.solid import manifold_arrays
from clutter6d.errors import MeshRejectedError

MIN_INERTIA_KG_M2 = 1e-9


def integrate_solid(
    vertices: Float[np.ndarray, "vertex 3"], faces: Int[np.ndarray, "face 3"]
) -> tuple[float, Float64[np.ndarray, "3"], Float64[np.ndarray, "3 3"]]:
    """Volume [m^3], centre of mass [m], and inertia about it for a mass of 1 kg [m^2].

    Raises:
        MeshRejectedError: The volume is not positive, or the inertia is not that of a body.
    """
    found = trimesh.triangles.mass_properties(vertices[faces], density=1.0, skip_inertia=False)
    volume = float(found.volume)
    if not np.isfinite(volume) or volume <= 0:
        raise MeshRejectedError("no-volume", f"its solid has a volume of {volume:.3g} m^3")
    inertia = np.asarray(found.inertia, dtype=np.float64) / volume
    if not is_inertia(inertia):
        raise MeshRejectedError("no-inertia", "its solid's inertia is not that of a body")
    centre = np.asarray(found.center_mass, dtype=np.float64)
    return float(_rounded(np.array(volume))), _rounded(centre), _rounded((inertia + inertia.T) / 2)


def _rounded(values: Float64[np.ndarray, "*shape"]) -> Float64[np.ndarray, "*shape"]:
    """To a billionth of the largest: the sums over triangles differ in their last digits between processors."""
    unit = 2.0 ** int(np.frexp(np.abs(values).max())[1])
    return np.asarray(np.round(values / unit, 9) * unit)


def integrate_manifold(
    solid: manifold3d.Manifold,
) -> tuple[float, Float64[np.ndarray, "3"], Float64[np.ndarray, "3 3"]]:
    """As ``integrate_solid``."""
    return integrate_solid(*manifold_arrays(solid))


def is_inertia(inertia: Float[np.ndarray, "3 3"]) -> bool:
    """Whether a matrix can be a body's inertia: finite, positive, and no moment above the sum of the two others."""
    if not np.isfinite(inertia).all():
        return False
    moments = np.linalg.eigvalsh((inertia + inertia.T) / 2)
    return bool(moments[0] > 0 and moments[2] <= (moments[0] + moments[1]) * (1 + 1e-9))


def scale_inertia(inertia_per_kg: Float64[np.ndarray, "3 3"], mass_kg: float) -> Float64[np.ndarray, "3 3"]:
    """The inertia of a mass, with a floor that keeps very small bodies stable in simulation [kg m^2]."""
    inertia = inertia_per_kg * mass_kg
    smallest = float(np.linalg.eigvalsh(inertia)[0])
    return inertia + max(MIN_INERTIA_KG_M2 - smallest, 0.0) * np.eye(3)
