"""From a library and a track to certified scenes, each from its own seed (paper, "Simulation Scene Generation")."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from clutter6d.assets.asset import Asset
from clutter6d.assets.collection import AssetCollection
from clutter6d.errors import GenerationError, InvalidValueError
from clutter6d.scene import TABLE, Scene, SceneGraph
from clutter6d.scenegen.draft import Draft
from clutter6d.scenegen.footprint import hull_points
from clutter6d.scenegen.generator_config import GeneratorConfig
from clutter6d.scenegen.pair_search import PairSearch
from clutter6d.scenegen.placement import PlacementSearch
from clutter6d.scenegen.scene_graphs import draw_scene_graph
from clutter6d.scenegen.track import Track
from clutter6d.seeding import generator


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
        library: AssetCollection,
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
            scene = self._attempt(index, rng, failures)
            if scene is not None:
                return GeneratedScene(scene=scene, failures=failures)
        raise GenerationError(
            f"{self._track.name} scene {index} of seed {self._seed}: no valid scene in {self._config.max_attempts} "
            f"attempts ({', '.join(f'{reason} {count}' for reason, count in failures.most_common())}); "
            "use a larger library or a larger clutter region"
        )

    def assets_of(self, scene: Scene) -> dict[str, Asset]:
        """The assets of a scene made by this generator, by content hash."""
        return {item.asset_hash: self._load(item.asset_name) for item in scene.objects}

    def _attempt(self, index: int, rng: np.random.Generator, failures: Counter[str]) -> Scene | None:
        """One draw of a scene; if it fails, the reason is counted."""
        draft = self._place(rng)
        if draft is None:
            failures["no free placement"] += 1
            return None
        found = PairSearch(draft, self._track, self._config, rng).run(failures)
        if found is None:
            failures["goal infeasible"] += 1
            return None
        pairs, certificate = found
        return Scene(
            scene_id=scene_id(self._track.name, self._seed, index),
            track=self._track.name,
            seed=self._seed,
            index=index,
            objects=draft.placed_objects(pairs[0].initial_stable_index),
            graph=draft.graph,
            goal_pairs=pairs,
            certificate=certificate,
        )

    def _place(self, rng: np.random.Generator) -> Draft | None:
        """Draw a graph and assets, and place the obstacles."""
        graph = self._graph or draw_scene_graph(self._track, rng)
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
            return None
        obstacles, layout = found
        names = ("target", *self._track.obstacle_names)
        return Draft(names=names, assets=assets, hulls=hulls, graph=graph, obstacles=obstacles, layout=layout)

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


def _pools(library: AssetCollection, track: Track, config: GeneratorConfig) -> dict[str, list[str]]:
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
