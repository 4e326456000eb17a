"""Placing obstacles in topological order by a recursive search for footprints that do not overlap."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from clutter6d.assets.asset import Asset
from clutter6d.geometry import quat_from_yaw, quat_multiply
from clutter6d.scene import TABLE, TABLE_SIZE_M, Relation, SceneGraph
from clutter6d.scenegen.footprint import DIRECTIONS, Layout, empty_layout, footprint_supports, separations_m
from clutter6d.scenegen.relations import RelationRules, candidates_fulfil
from clutter6d.scenegen.track import Region, Track


@dataclass(frozen=True, kw_only=True, slots=True)
class PlacementConfig:
    """How hard to search.

    Attributes:
        candidates: Positions tried at once for one orientation.
        orientations: Orientations tried for one object before going back to the object before it.
        budget: Orientations tried for one scene before giving up.
        slack_m: How far inside a relation's thresholds to place, so that settling cannot break it.
        table_margin_m: Distance that a footprint keeps from the table's edge.
        release_gap_m: Height above its supporter from which a stacked object is let go.
    """

    candidates: int = 128
    orientations: int = 4
    budget: int = 400
    slack_m: float = 0.003
    table_margin_m: float = 0.01
    release_gap_m: float = 0.001


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Placed:
    """Where one object was put.

    Attributes:
        stable_index: Stable orientation it was placed in.
        pose: Object frame to world frame.
    """

    stable_index: int
    pose: Float64[np.ndarray, "7"]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Orientations:
    """Candidate orientations of one object, with random yaw.

    Attributes:
        stable_indices: Which stable orientation each one is.
        quats_wxyz: Object frame to world frame.
        heights_m: Height of the origin above the table at rest.
        supports: Support functions of the footprints.
        spans: Lowest and highest point relative to the origin.
    """

    stable_indices: np.ndarray
    quats_wxyz: Float64[np.ndarray, "n 4"]
    heights_m: Float64[np.ndarray, "n"]
    supports: Float64[np.ndarray, "n direction"]
    spans: Float64[np.ndarray, "n 2"]


def draw_orientations(
    asset: Asset,
    hull: Float64[np.ndarray, "point 3"],
    count: int,
    rng: np.random.Generator,
    *,
    by_probability: bool = False,
) -> Orientations:
    """Stable orientations, each with a free yaw.

    Args:
        asset: The object.
        hull: Its hull points.
        count: How many.
        rng: Source of every draw.
        by_probability: Draw an orientation as often as a dropped object comes to rest in it, instead of evenly.
    """
    weights = asset.stable.probabilities if by_probability else None
    indices = rng.choice(len(asset.stable.quats_wxyz), size=count, p=weights)
    yaw = quat_from_yaw(rng.uniform(-np.pi, np.pi, size=count))
    quats = quat_multiply(yaw, asset.stable.quats_wxyz[indices])
    supports, spans = footprint_supports(hull, quats)
    return Orientations(
        stable_indices=indices,
        quats_wxyz=quats,
        heights_m=asset.stable.heights_m[indices],
        supports=supports,
        spans=spans,
    )


def draw_positions(region: Region, count: int, rng: np.random.Generator) -> Float64[np.ndarray, "n 2"]:
    """Positions drawn evenly from a region."""
    low, high = np.array([region.x, region.y]).T
    return low + (high - low) * rng.random((count, 2))


def is_on_table(
    positions: Float64[np.ndarray, "n 2"], supports: Float64[np.ndarray, "#n direction"], margin_m: float
) -> Bool[np.ndarray, "n"]:
    """Whether whole footprints lie on the table."""
    quarter = len(DIRECTIONS) // 4
    half_x, half_y = (side / 2 - margin_m for side in TABLE_SIZE_M)
    is_inside = (positions[:, 0] + supports[:, 0] <= half_x) & (positions[:, 1] + supports[:, quarter] <= half_y)
    is_inside &= positions[:, 0] - supports[:, 2 * quarter] >= -half_x
    is_inside &= positions[:, 1] - supports[:, 3 * quarter] >= -half_y
    return is_inside


class PlacementSearch:
    """A depth-first search over obstacles in placement order.

    Args:
        graph: What should stand where; the target is left out.
        assets: The asset of each object, by the object's name.
        hulls: Their hull points, by the object's name.
        track: Regions and gaps.
        rules: Thresholds of the relations.
        config: How hard to search.
        rng: Source of every draw.
    """

    def __init__(
        self,
        *,
        graph: SceneGraph,
        assets: Mapping[str, Asset],
        hulls: Mapping[str, np.ndarray],
        track: Track,
        rules: RelationRules,
        config: PlacementConfig,
        rng: np.random.Generator,
    ) -> None:
        self._order = [name for name in graph.placement_order() if name != "target"]
        self._graph, self._assets, self._hulls = graph, assets, hulls
        self._track, self._rules, self._config, self._rng = track, rules, config, rng
        self._spent = 0

    def run(self) -> tuple[dict[str, Placed], Layout] | None:
        """Poses of all obstacles and their layout, or ``None`` if the budget ran out."""
        return self._place(0, {}, empty_layout())

    def _place(self, depth: int, placed: dict[str, Placed], layout: Layout) -> tuple[dict[str, Placed], Layout] | None:
        if depth == len(self._order):
            return placed, layout
        name = self._order[depth]
        options = draw_orientations(self._assets[name], self._hulls[name], self._config.orientations, self._rng)
        for row in range(self._config.orientations):
            self._spent += 1
            if self._spent > self._config.budget:
                return None
            position = self._find_position(name, options.supports[row, None], layout)
            if position is None:
                continue
            base = self._base_height(name, layout)
            height = options.heights_m[row] if base == 0 else base - options.spans[row, 0]
            pose = np.concatenate([position, [height], options.quats_wxyz[row]])
            result = self._place(
                depth + 1,
                {**placed, name: Placed(stable_index=int(options.stable_indices[row]), pose=pose)},
                layout.with_object(name, position, options.supports[row], float(height + options.spans[row, 1])),
            )
            if result is not None:
                return result
        return None

    def _base_height(self, name: str, layout: Layout) -> float:
        carrier = _stands_on(self._graph, name)
        return 0.0 if carrier == TABLE else float(layout.tops[layout.index(carrier)]) + self._config.release_gap_m

    def _find_position(
        self, name: str, support: Float64[np.ndarray, "1 direction"], layout: Layout
    ) -> Float64[np.ndarray, "2"] | None:
        """One position that is free, on the table or its supporter, and in the right relations."""
        carriers = _carriers(self._graph, name)
        positions = draw_positions(self._track.clutter_region, self._config.candidates, self._rng)
        if carriers:
            positions = _positions_upon(carriers[0], layout, self._config.candidates, self._rng)
        good = is_on_table(positions, support, self._config.table_margin_m)
        for relation in relations_of(self._graph, name):
            good &= candidates_fulfil(relation, positions, support, layout, self._rules, slack_m=self._config.slack_m)
        others = layout
        for carrier in carriers:
            others = others.without(carrier)
        left = positions[good]
        is_free = (separations_m(left, support, others) >= self._track.min_gap_m).all(axis=1)
        found = np.flatnonzero(is_free)
        return left[found[0]] if len(found) else None


def relations_of(graph: SceneGraph, subject: str) -> Sequence[Relation]:
    """The planar relations of one subject."""
    return [item for item in graph.relations if item.subject == subject and item.kind != "on"]


def _stands_on(graph: SceneGraph, name: str) -> str:
    return next(item.reference for item in graph.of_kind("on") if item.subject == name)


def _carriers(graph: SceneGraph, name: str) -> list[str]:
    """What carries an object, nearest first, without the table."""
    chain: list[str] = []
    while (carrier := _stands_on(graph, name)) != TABLE:
        chain.append(carrier)
        name = carrier
    return chain


def _positions_upon(carrier: str, layout: Layout, count: int, rng: np.random.Generator) -> Float64[np.ndarray, "n 2"]:
    """Positions over the inner half of a carrier's footprint."""
    row = layout.index(carrier)
    angle, share = rng.integers(len(DIRECTIONS), size=count), rng.uniform(0, 0.5, size=count)
    inner = np.minimum(layout.supports[row], np.roll(layout.supports[row], len(DIRECTIONS) // 2)).min()
    return layout.positions[row] + (share * inner)[:, None] * DIRECTIONS[angle]
