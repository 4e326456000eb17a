"""Which scene and goal pair an episode is: drawn from a split by a named stream, or chosen."""

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from clutter6d.assets.asset import Asset
from clutter6d.dataset.scenes import SceneCollection
from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.scene import GoalPair, Scene
from clutter6d.seeding import generator
from clutter6d.sim.scene_model import SceneModel, compile_stored_scene


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Task:
    """One goal pair of one scene, ready to be simulated."""

    scene: Scene
    pair_index: int
    model: SceneModel

    @property
    def pair(self) -> GoalPair:
        """The goal pair."""
        return self.scene.goal_pairs[self.pair_index]

    @property
    def assets(self) -> Mapping[str, Asset]:
        """The scene's assets by content hash."""
        return {asset.content_hash: asset for asset in self.model.assets}


def _as_it_is(scene: SceneModel) -> SceneModel:
    return scene


class TaskSource:
    """Tasks of a collection of scenes; compiled models are kept, those not used for longest are forgotten first.

    Args:
        scenes: Where scenes and assets come from.
        kept_models: Compiled models kept, about 1.4 MB (sparse) to 3.2 MB (dense) each.
        prepare: Makes what is simulated of a compiled scene.

    Raises:
        InvalidValueError: There is no scene, or nothing may be kept.
    """

    def __init__(
        self,
        scenes: SceneCollection,
        *,
        kept_models: int = 1024,
        prepare: Callable[[SceneModel], SceneModel] = _as_it_is,
    ) -> None:
        if kept_models < 1:
            raise InvalidValueError(f"kept models is {kept_models}; at least 1 is needed")
        self._collection, self._scenes = scenes, scenes.scenes
        if not self._scenes:
            raise InvalidValueError("there are no scenes to draw tasks from")
        self._by_id = {scene.scene_id: scene for scene in self._scenes}
        self._kept, self._prepare, self._models = kept_models, prepare, OrderedDict[str, SceneModel]()

    @property
    def sha256(self) -> str:
        """Names exactly this set of scenes."""
        return self._collection.sha256

    @property
    def tracks(self) -> frozenset[str]:
        """Tracks of the scenes."""
        return frozenset(scene.track for scene in self._scenes)

    def first(self) -> Task:
        """The first pair of the first scene."""
        return self._make(self._scenes[0], 0)

    def draw(self, seed: int, number: int) -> Task:
        """The ``number``-th task of a stream; scenes evenly, then pairs evenly."""
        rng = generator(seed, "task", number)
        scene = self._scenes[rng.integers(len(self._scenes))]
        return self._make(scene, int(rng.integers(len(scene.goal_pairs))))

    def choose(self, scene_id: str, pair_index: int) -> Task:
        """A task by scene and pair.

        Raises:
            UnknownNameError: There is no scene of that id.
            InvalidValueError: The scene has no such pair.
        """
        if scene_id not in self._by_id:
            raise UnknownNameError("scene", scene_id, self._by_id)
        pairs = len(self._by_id[scene_id].goal_pairs)
        if not 0 <= pair_index < pairs:
            raise InvalidValueError(f"scene {scene_id} has goal pairs 0 to {pairs - 1}, not {pair_index}")
        return self._make(self._by_id[scene_id], pair_index)

    def _make(self, scene: Scene, pair_index: int) -> Task:
        if scene.scene_id not in self._models:
            compiled = compile_stored_scene(scene, self._collection.assets_of(scene))
            self._models[scene.scene_id] = self._prepare(compiled)
            if len(self._models) > self._kept:
                self._models.popitem(last=False)
        self._models.move_to_end(scene.scene_id)
        return Task(scene=scene, pair_index=pair_index, model=self._models[scene.scene_id])
