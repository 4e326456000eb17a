"""From a library and a track to certified scenes, each from its own seed (paper, "Simulation Scene Generation")."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from clutter6d.assets.asset import Asset
from clutter6d.assets.library import AssetLibrary
from clutter6d.errors import GenerationError, InvalidValueError
from clutter6d.geometry import Pose
from clutter6d.scene import TABLE, GoalPair, PlacedObject, Scene, SceneGraph
from clutter6d.scenegen.certificate import (
    CertificateLimits,
    StateReport,
    is_reachable,
    make_certificate,
    settle_and_check,
)
from clutter6d.scenegen.footprint import Layout, footprint_supports, hull_points
from clutter6d.scenegen.goal_pairs import (
    TargetPoses,
    changes_resting_face,
    find_target_poses,
    is_path_blocked,
    pair_up,
)
from clutter6d.scenegen.placement import Placed, PlacementConfig, PlacementSearch, relations_of
from clutter6d.scenegen.relations import RelationRules
from clutter6d.scenegen.scene_graphs import draw_scene_graph
from clutter6d.scenegen.track import Track
from clutter6d.seeding import generator
from clutter6d.sim.scene_model import SceneModel, compile_scene
from clutter6d.sim.settle import SettleConfig


@dataclass(frozen=True, kw_only=True, slots=True)
class GeneratorConfig:
    """How scenes are drawn and what counts as valid.

    Attributes:
        max_attempts: Draws of one scene before giving up.
        pose_draws: Target poses drawn for one round of goal pairs.
        rounds: Rounds in which missing goal pairs are drawn again.
        spare_pairs: Pairs settled in a round beyond those missing, since some fail.
        max_target_mass_kg: Heaviest target; the arm pushes it with its hand.
        rules: Thresholds of the relations.
        placement: How hard to search for a placement.
        settle: When objects count as at rest.
        limits: What a valid scene must keep.
    """

    max_attempts: int = 100
    pose_draws: int = 256
    rounds: int = 3
    spare_pairs: int = 2
    max_target_mass_kg: float = 2.0
    rules: RelationRules = field(default_factory=RelationRules)
    placement: PlacementConfig = field(default_factory=PlacementConfig)
    settle: SettleConfig = field(default_factory=SettleConfig)
    limits: CertificateLimits = field(default_factory=CertificateLimits)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class GeneratedScene:
    """A scene and what it took.

    Attributes:
        scene: The certified scene.
        failures: Failed attempts and failed states by reason.
    """

    scene: Scene
    failures: Counter[str]


def scene_id(track: str, seed: int, index: int) -> str:
    """Name of a scene."""
    return f"{track}-{seed}-{index:05d}"


class _AttemptError(Exception):
    """One draw of a scene failed; the argument is the reason."""


class SceneGenerator:
    """Draws scenes of one track from one library.

    Args:
        library: Where assets come from.
        track: What a scene is made of.
        seed: The user's seed; scene ``index`` under it is always the same scene.
        config: How scenes are drawn.
        graph: A scene graph to realise instead of a random one; names as :attr:`Track.obstacle_names`.

    Raises:
        InvalidValueError: The library has too few assets of a cohort, or the graph does not fit the track.
    """

    def __init__(
        self,
        library: AssetLibrary,
        track: Track,
        seed: int,
        *,
        config: GeneratorConfig | None = None,
        graph: SceneGraph | None = None,
    ) -> None:
        self._library, self._track, self._seed = library, track, seed
        self._config = config or GeneratorConfig()
        self._graph = graph
        self._pools = _pools(library, track, self._config)
        self._assets: dict[str, Asset] = {}
        self._hulls: dict[str, np.ndarray] = {}
        if graph is not None:
            _check_graph(graph, track)

    def generate(self, index: int) -> GeneratedScene:
        """Scene number ``index``.

        Raises:
            GenerationError: No valid scene was found within the allowed attempts.
        """
        failures: Counter[str] = Counter()
        for attempt in range(self._config.max_attempts):
            rng = generator(self._seed, "scene", self._track.name, index, attempt)
            try:
                return GeneratedScene(scene=self._attempt(index, rng, failures), failures=failures)
            except _AttemptError as failed:
                failures[str(failed)] += 1
        raise GenerationError(
            f"{self._track.name} scene {index} of seed {self._seed}: no valid scene in {self._config.max_attempts} "
            f"attempts ({', '.join(f'{reason} {count}' for reason, count in failures.most_common())}); "
            "use a larger library or a larger clutter region"
        )

    def assets_of(self, scene: Scene) -> dict[str, Asset]:
        """The assets of a scene made by this generator, by content hash."""
        return {item.asset_hash: self._load(item.asset_name) for item in scene.objects}

    def _attempt(self, index: int, rng: np.random.Generator, failures: Counter[str]) -> Scene:
        graph = self._graph or draw_scene_graph(self._track, rng)
        names = ("target", *self._track.obstacle_names)
        assets = {name: self._load(asset) for name, asset in self._draw_assets(rng).items()}
        hulls = {name: self._hulls[asset.content_hash] for name, asset in assets.items()}
        search = PlacementSearch(
            graph=graph,
            assets=assets,
            hulls=hulls,
            track=self._track,
            rules=self._config.rules,
            config=self._config.placement,
            rng=rng,
        )
        found = search.run()
        if found is None:
            raise _AttemptError("no free placement")
        draft = _Draft(
            names=names, assets=assets, hulls=hulls, graph=graph, obstacles=found[0], layout=found[1], rng=rng
        )
        pairs, reports, rows = self._find_pairs(draft, failures)
        return Scene(
            scene_id=scene_id(self._track.name, self._seed, index),
            track=self._track.name,
            seed=self._seed,
            index=index,
            objects=tuple(draft.placed_object(name, pairs[0]) for name in names),
            graph=graph,
            goal_pairs=tuple(pairs),
            certificate=make_certificate(reports, rows, len(graph.relations)),
        )

    def _find_pairs(
        self, draft: "_Draft", failures: Counter[str]
    ) -> tuple[list[GoalPair], list[StateReport], list[np.ndarray]]:
        """Goal pairs, with the reports they come from and their rows (initial and goal states)."""
        scene: SceneModel | None = None
        pairs: list[GoalPair] = []
        reports: list[StateReport] = []
        rows: list[np.ndarray] = []
        for _ in range(self._config.rounds):
            missing = self._track.goal_pairs - len(pairs)
            initial, goal, chosen = self._draw_pairs(draft, missing)
            if len(chosen) < missing:
                raise _AttemptError("goal infeasible")
            scene = scene or compile_scene([(name, draft.assets[name]) for name in draft.names])
            starts = draft.states(initial.poses[[pair[0] for pair in chosen]])
            goals = draft.states(goal.poses[[pair[1] for pair in chosen]])
            report = self._check(scene, draft, np.concatenate([starts, goals]))
            failures.update(reason for reason in report.failures if reason is not None)
            good = [
                number
                for number in range(len(chosen))
                if report.failures[number] is None and report.failures[number + len(chosen)] is None
            ][:missing]
            faces = changes_resting_face(report.poses[: len(chosen), 0, 3:], report.poses[len(chosen) :, 0, 3:])
            for number in good:
                first, second = chosen[number]
                start, end = report.poses[number], report.poses[number + len(chosen), 0]
                pairs.append(
                    GoalPair(
                        initial=Pose.from_row(start[0]),
                        goal=Pose.from_row(end),
                        object_poses=start,
                        initial_stable_index=int(initial.stable_indices[first]),
                        goal_stable_index=int(goal.stable_indices[second]),
                        is_path_blocked=is_path_blocked(start[0, :2], end[:2], initial.supports[first], draft.layout),
                        changes_resting_face=bool(faces[number]),
                    )
                )
            reports.append(report)
            rows.append(np.array([*good, *(number + len(chosen) for number in good)], dtype=int))
            if len(pairs) == self._track.goal_pairs:
                return pairs, reports, rows
            if not good:
                break
        raise _AttemptError("goal infeasible")

    def _draw_pairs(self, draft: "_Draft", missing: int) -> tuple[TargetPoses, TargetPoses, list[tuple[int, int]]]:
        initial, goal = (
            find_target_poses(
                asset=draft.assets["target"],
                hull=draft.hulls["target"],
                track=self._track,
                layout=draft.layout,
                relations=relations,
                rules=self._config.rules,
                config=self._config.placement,
                count=self._config.pose_draws,
                by_probability=is_goal,
                rng=draft.rng,
            )
            for relations, is_goal in (
                (relations_of(draft.graph, "target"), False),
                (self._track.goal_relations, True),
            )
        )
        wanted = missing + self._config.spare_pairs
        return initial, goal, pair_up(initial, goal, self._track.min_displacement_m, wanted)

    def _check(self, scene: SceneModel, draft: "_Draft", states: np.ndarray) -> StateReport:
        """Settle and examine states; a valid one whose target the hand cannot reach is not valid either."""
        hulls = tuple(draft.hulls[name] for name in draft.names)
        report = settle_and_check(
            scene,
            hulls,
            states,
            draft.graph,
            rules=self._config.rules,
            limits=self._config.limits,
            config=self._config.settle,
        )
        _, spans = footprint_supports(draft.hulls["target"], report.poses[:, 0, 3:])
        reachable = is_reachable(scene, report.poses, report.poses[:, 0, 2] + spans[:, 1], self._config.limits)
        failures = tuple(
            "unreachable" if failure is None and not can_reach else failure
            for failure, can_reach in zip(report.failures, reachable, strict=True)
        )
        return StateReport(
            poses=report.poses,
            penetration_m=report.penetration_m,
            drift_m=report.drift_m,
            drift_rad=report.drift_rad,
            failures=failures,
        )

    def _draw_assets(self, rng: np.random.Generator) -> dict[str, str]:
        """An asset's name for each object; no asset twice in a scene."""
        target = str(rng.choice(self._pools["target"]))
        small = [name for name in self._pools["small"] if name != target]
        chosen = [*rng.choice(self._pools["large"], size=self._track.large_obstacles, replace=False)]
        chosen += [*rng.choice(small, size=self._track.small_obstacles, replace=False)]
        return {"target": target} | dict(zip(self._track.obstacle_names, map(str, chosen), strict=True))

    def _load(self, name: str) -> Asset:
        if name not in self._assets:
            asset = self._library.load(name)
            self._assets[name] = asset
            self._hulls[asset.content_hash] = hull_points(asset)
        return self._assets[name]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class _Draft:
    """A placed scene before its goal pairs are known."""

    names: tuple[str, ...]
    assets: Mapping[str, Asset]
    hulls: Mapping[str, np.ndarray]
    graph: SceneGraph
    obstacles: Mapping[str, Placed]
    layout: Layout
    rng: np.random.Generator

    def states(self, target_poses: np.ndarray) -> np.ndarray:
        """Poses of all objects (state, object, 7) with the target in each of several poses."""
        obstacles = np.array([self.obstacles[name].pose for name in self.names[1:]])
        repeated = np.broadcast_to(obstacles, (len(target_poses), *obstacles.shape))
        return np.concatenate([target_poses[:, None], repeated], axis=1)

    def placed_object(self, name: str, first_pair: GoalPair) -> PlacedObject:
        """The stored form of one object; the target's orientation is that of the first goal pair."""
        role = "target" if name == "target" else "large" if name.startswith("large") else "small"
        placed = self.obstacles.get(name)
        return PlacedObject(
            name=name,
            asset_name=self.assets[name].name,
            asset_hash=self.assets[name].content_hash,
            role=role,
            stable_index=first_pair.initial_stable_index if placed is None else placed.stable_index,
        )


def _pools(library: AssetLibrary, track: Track, config: GeneratorConfig) -> dict[str, list[str]]:
    """Names of the library's assets by what they may be in a scene, sorted."""
    index = library.index()
    small = index[index["size_class"] == "small"]
    pools = {
        "large": sorted(index[index["size_class"] == "large"]["name"]),
        "small": sorted(small["name"]),
        "target": sorted(small[small["mass_kg"] <= config.max_target_mass_kg]["name"]),
    }
    needed = {"large": track.large_obstacles, "small": track.small_obstacles + 1, "target": 1}
    for cohort, count in needed.items():
        if len(pools[cohort]) < count:
            raise InvalidValueError(
                f"library {library.path}: {len(pools[cohort])} assets can be '{cohort}', but a {track.name} scene "
                f"needs {count}; process more assets"
            )
    return pools


def _check_graph(graph: SceneGraph, track: Track) -> None:
    expected = {"target", *track.obstacle_names}
    if set(graph.objects) != expected:
        raise InvalidValueError(f"scene graph: objects must be {sorted(expected)} for the {track.name} track")
    if any(item.subject == "target" and item.reference != TABLE for item in graph.of_kind("on")):
        raise InvalidValueError("scene graph: the target must stand on the table")
    graph.placement_order()
