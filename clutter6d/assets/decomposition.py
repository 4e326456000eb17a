"""Convex parts of a solid: CoACD's light search, merged to few parts, each cut down to few vertices, then measured.

Parameters were chosen by measurement on household meshes: the light search (``SEARCHES``) takes under a second at the
median where CoACD's defaults take ten to ninety. What the shape loses is measured on the parts' union, and a result
out of tolerance is done again with the finer search; the better of the two is kept and the retry is on record.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import manifold3d
import numpy as np
from jaxtyping import Float

from clutter6d.assets.asset import Mesh
from clutter6d.assets.convex_part import hull_of, part_vertices, reduce_hull
from clutter6d.assets.solid import manifold_arrays, simplify_solid
from clutter6d.assets.surface_distance import SurfaceDistance, sample_surface
from clutter6d.errors import InvalidValueError, MeshRejectedError
from clutter6d.seeding import generator

MAX_PARTS = 16
MAX_PART_VERTICES = 32
Effort = Literal["normal", "coarse", "hull"]

_QUICK = {"mcts_iterations": 20, "mcts_max_depth": 2, "mcts_nodes": 6, "resolution": 500, "preprocess_mode": "off"}
SEARCHES: dict[str, dict[str, Any]] = {
    "finer": {**_QUICK, "threshold": 0.05},
    "light": {**_QUICK, "threshold": 0.1},
    "coarse": {**_QUICK, "threshold": 0.3, "mcts_iterations": 10, "mcts_max_depth": 1, "preprocess_mode": "auto"},
}


@dataclass(frozen=True, kw_only=True, slots=True)
class DecompositionSettings:
    """Limits of a decomposition.

    Attributes:
        max_parts: Convex parts of one asset.
        max_part_vertices: Vertices of one part.
        convexity: Share of its hull that a solid must fill to be taken as its hull.
        merge_volume: Two parts become one if that adds less than this share of the hull's volume.
        max_hausdorff: Hausdorff distance, as a share of the longest side, above which the finer search is tried.
        max_added_volume: Volume of the union beyond the solid's, as a share of the hull's, likewise.
        search_faces: Triangles of the solid that CoACD sees; its time grows with them, its result hardly changes.
        preprocess_resolution: Of CoACD's own remeshing, which the coarse search uses; the solid is closed already.
    """

    max_parts: int = MAX_PARTS
    max_part_vertices: int = MAX_PART_VERTICES
    convexity: float = 0.97
    merge_volume: float = 0.001
    max_hausdorff: float = 0.06
    max_added_volume: float = 0.15
    search_faces: int = 400
    preprocess_resolution: int = 30

    def __post_init__(self) -> None:
        """Refuse limits that no solid can keep."""
        if self.max_parts < 1 or self.max_part_vertices < 4:
            raise InvalidValueError(
                f"max_parts is {self.max_parts} and max_part_vertices is {self.max_part_vertices}; "
                "at least 1 part of 4 vertices is needed"
            )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Decomposition:
    """Convex parts, and what they cost.

    Attributes:
        parts: Each one convex hull.
        volume_ratio: Volume of the parts' union over the solid's.
        hull_volume_ratio: Summed volume of the parts over the convex hull's.
        hausdorff_m: Symmetric Hausdorff distance between the solid and the union.
        fallbacks: What did not go the normal way.
    """

    parts: tuple[Mesh, ...]
    volume_ratio: float
    hull_volume_ratio: float
    hausdorff_m: float
    fallbacks: tuple[str, ...]


def decompose(
    solid: manifold3d.Manifold, settings: DecompositionSettings, *, effort: Effort = "normal"
) -> Decomposition:
    """Convex parts of a closed solid.

    Args:
        solid: The solid [m].
        settings: Limits.
        effort: ``normal``; ``coarse`` or ``hull`` where more was tried before and killed the process.

    Returns:
        At least one part.

    Raises:
        MeshRejectedError: The solid is flat.
    """
    if effort == "hull" or solid.volume() >= settings.convexity * solid.hull().volume():
        fallbacks = ("decomposition:hull",) if effort == "hull" else ()
        return measure_parts(solid, [part_vertices(solid.hull())], settings, fallbacks)
    if effort == "coarse":
        found = _merged(_search(solid, "coarse", settings), solid, settings)
        return measure_parts(solid, found, settings, ("decomposition:coarse",))
    hulls = _search(solid, "light", settings)
    light = measure_parts(solid, _merged(hulls, solid, settings), settings, ())
    if _excess(light, solid, settings) <= 1:
        return light
    tried = [light, measure_parts(solid, [part_vertices(solid.hull())], settings, ("decomposition:better-as-hull",))]
    if len(hulls) < settings.max_parts:
        finer = _merged(_search(solid, "finer", settings), solid, settings)
        tried.append(measure_parts(solid, finer, settings, ("decomposition:finer",)))
    best = min(tried, key=lambda result: _excess(result, solid, settings))
    if _excess(best, solid, settings) <= 1:
        return best
    return replace(best, fallbacks=(*best.fallbacks, "decomposition:out-of-tolerance"))


def _excess(result: Decomposition, solid: manifold3d.Manifold, settings: DecompositionSettings) -> float:
    """How far out of tolerance a result is; at most 1 if it is within."""
    box = np.array(solid.bounding_box())
    longest = float((box[3:] - box[:3]).max())
    added = (result.volume_ratio - 1) * solid.volume() / solid.hull().volume()
    return max(result.hausdorff_m / (settings.max_hausdorff * longest), abs(added) / settings.max_added_volume)


def _search(solid: manifold3d.Manifold, search: str, settings: DecompositionSettings) -> list[manifold3d.Manifold]:
    """CoACD's parts, before any merging: merging here is faster, exact, and cannot abort the process."""
    import coacd  # here, since Ray cannot start in a process that has loaded it

    coacd.set_log_level("error")
    vertices, faces = manifold_arrays(simplify_solid(solid, settings.search_faces))
    found = coacd.run_coacd(
        coacd.Mesh(vertices, faces),
        preprocess_resolution=settings.preprocess_resolution,
        merge=False,
        seed=0,
        **SEARCHES[search],
    )
    hulls = [hull for hull in (hull_of(np.asarray(points)) for points, _ in found) if hull is not None]
    return hulls or [solid.hull()]


def _merged(
    hulls: Sequence[manifold3d.Manifold], solid: manifold3d.Manifold, settings: DecompositionSettings
) -> list[Float[np.ndarray, "_ 3"]]:
    added = settings.merge_volume * solid.hull().volume()
    return [part_vertices(hull) for hull in merge_hulls(hulls, max_parts=settings.max_parts, added_volume=added)]


def merge_hulls(
    hulls: Sequence[manifold3d.Manifold], *, max_parts: int, added_volume: float
) -> list[manifold3d.Manifold]:
    """Merge convex parts, the pair that adds least volume first.

    Args:
        hulls: Convex parts.
        max_parts: Merge until there are no more than these.
        added_volume: Merge on while a pair adds less than this [m^3].
    """
    parts = list(hulls)
    costs = np.full((len(parts), len(parts)), np.inf)
    for i in range(len(parts)):
        for j in range(i):
            costs[i, j] = _merge_cost(parts[i], parts[j])
    alive = list(range(len(parts)))
    while len(alive) > 1:
        i, j = (int(index) for index in np.unravel_index(np.argmin(costs), costs.shape))
        if len(alive) <= max_parts and costs[i, j] > added_volume:
            break
        parts[j] = manifold3d.Manifold.batch_hull([parts[i], parts[j]])
        alive.remove(i)
        costs[i, :] = costs[:, i] = np.inf
        for other in alive:
            if other != j:
                costs[max(other, j), min(other, j)] = _merge_cost(parts[other], parts[j])
    return [parts[index] for index in alive]


def _merge_cost(first: manifold3d.Manifold, second: manifold3d.Manifold) -> float:
    return manifold3d.Manifold.batch_hull([first, second]).volume() - first.volume() - second.volume()


def measure_parts(
    solid: manifold3d.Manifold,
    parts: Sequence[Float[np.ndarray, "_ 3"]],
    settings: DecompositionSettings,
    fallbacks: tuple[str, ...],
) -> Decomposition:
    """Cut parts down to the vertex limit and measure their union against the solid.

    Raises:
        MeshRejectedError: No part has a volume.
    """
    reduced = [reduce_hull(points, settings.max_part_vertices) for points in parts]
    hulls = [hull for hull in reduced if hull is not None]
    if not hulls:
        raise MeshRejectedError("flat", "none of its convex parts has a volume")
    union = manifold3d.Manifold.batch_boolean(hulls, manifold3d.OpType.Add) if len(hulls) > 1 else hulls[0]
    return Decomposition(
        parts=tuple(_to_mesh(hull) for hull in hulls),
        volume_ratio=float(union.volume() / solid.volume()),
        hull_volume_ratio=float(sum(hull.volume() for hull in hulls) / solid.hull().volume()),
        hausdorff_m=hausdorff_distance(solid, union),
        fallbacks=fallbacks,
    )


def hausdorff_distance(first: manifold3d.Manifold, second: manifold3d.Manifold, *, points: int = 2000) -> float:
    """Symmetric Hausdorff distance between two solids, over points drawn on their differences' surfaces [m].

    A point of one solid that lies inside the other has no distance to it; so cuts between touching parts, which are
    surfaces of no consequence inside the shape, do not count.
    """
    return max(_directed_distance(first, second, points), _directed_distance(second, first, points))


def _directed_distance(source: manifold3d.Manifold, target: manifold3d.Manifold, points: int) -> float:
    beyond = source - target
    if beyond.is_empty():
        return 0.0
    vertices, faces = manifold_arrays(beyond)
    drawn, _ = sample_surface(vertices, faces, points, generator(0, "hausdorff"))
    _, distance = SurfaceDistance(*manifold_arrays(target), samples=10_000).closest(
        np.concatenate([drawn, vertices]), neighbours=8
    )
    return float(distance.max())


def _to_mesh(hull: manifold3d.Manifold) -> Mesh:
    vertices, faces = manifold_arrays(hull)
    return Mesh(vertices=vertices.astype(np.float32), faces=faces.astype(np.int32))
