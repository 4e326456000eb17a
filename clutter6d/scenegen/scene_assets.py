"""The assets of scenes: read once each, and checked against the scenes that name them."""

from collections.abc import Callable, Mapping
from pathlib import Path

from clutter6d.assets.asset import Asset
from clutter6d.assets.collection import AssetCollection
from clutter6d.errors import InvalidFileError, UnknownNameError
from clutter6d.scene import PlacedObject, Scene


class SceneAssets:
    """Assets by content hash, kept once they are read.

    Args:
        open_collection: Gives the collection that holds them; called when the first is read.
    """

    def __init__(self, open_collection: Callable[[], AssetCollection]) -> None:
        self._open = open_collection
        self._assets: dict[str, Asset] = {}

    def of(self, scene: Scene, file: Path) -> Mapping[str, Asset]:
        """The assets of a scene by content hash.

        Args:
            scene: The scene.
            file: Where it is stored, for messages.

        Raises:
            InvalidFileError: One is missing or damaged, or has not the orientation that the scene names.
        """
        for item in scene.objects:
            if item.asset_hash not in self._assets:
                self._assets[item.asset_hash] = self._load(scene, item)
            orientations = len(self._assets[item.asset_hash].stable.heights_m)
            if item.stable_index >= orientations:
                problem = f"'{item.name}' rests in orientation {item.stable_index}"
                raise InvalidFileError(file, f"scene {scene.scene_id}: {problem}, {item.asset_name} has {orientations}")
        return {item.asset_hash: self._assets[item.asset_hash] for item in scene.objects}

    def _load(self, scene: Scene, item: PlacedObject) -> Asset:
        try:
            return self._open().load(item.asset_hash)
        except UnknownNameError:
            problem = f"asset {item.asset_name} ({item.asset_hash[:12]}) is missing; copy it here"
            raise InvalidFileError(self._open().path, f"scene {scene.scene_id}: {problem}") from None
