"""Scenes of tracks of our own, made in memory: other numbers of objects, or nothing but boxes."""

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from bars import bar

from clutter6d.assets.asset import Asset
from clutter6d.assets.collection import AssetCollection
from clutter6d.dataset.dataset import DEFAULT_DATASET, open_dataset
from clutter6d.dataset.split import Split
from clutter6d.scene import Scene
from clutter6d.scenegen.generator import SceneGenerator
from clutter6d.scenegen.track import Region, Track

WHOLE_TABLE = Region(x=(-0.38, 0.38), y=(-0.58, 0.58))


class GeneratedScenes:
    """The first scenes of seed 0 of a track, settled and certified like any other, each with its goal pairs.

    Args:
        track: What a scene is made of.
        library: Where its assets come from.
        count: Scenes.
    """

    def __init__(self, track: Track, library: AssetCollection, count: int) -> None:
        self._generator = SceneGenerator(library, track, 0)
        self._scenes = tuple(
            self._generator.generate(index).scene for index in bar(range(count), f"making {track.name}")
        )

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """The scenes."""
        return self._scenes

    @property
    def sha256(self) -> str:
        """Not a frozen set."""
        return "0" * 64

    def assets_of(self, scene: Scene) -> Mapping[str, Asset]:
        """The assets of a scene by content hash."""
        return self._generator.assets_of(scene)


@dataclass(frozen=True, slots=True)
class FirstScenes:
    """The first scenes of a collection.

    Attributes:
        whole: The collection.
        count: Scenes.
    """

    whole: Split
    count: int

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """The scenes."""
        return tuple(self.whole[index] for index in range(min(self.count, len(self.whole))))

    @property
    def sha256(self) -> str:
        """Not a frozen set."""
        return "0" * 64

    def assets_of(self, scene: Scene) -> Mapping[str, Asset]:
        """The assets of a scene by content hash."""
        return self.whole.assets_of(scene)


def crowded_scenes(objects: int, count: int) -> GeneratedScenes:
    """Objects of the frozen data set, nearly half of them large, anywhere on the table."""
    large = (objects - 1) // 2
    track = Track(
        name=f"{objects}-objects",
        large_obstacles=large,
        small_obstacles=objects - 1 - large,
        clutter_region=WHOLE_TABLE,
        goal_pairs=1,
    )
    return GeneratedScenes(track, open_dataset(DEFAULT_DATASET).assets, count)


def box_scenes(objects: int, count: int) -> GeneratedScenes:
    """Boxes only, one convex part each, as the peers' objects are."""
    from tests.box_library import make_box_library

    with tempfile.TemporaryDirectory() as folder:
        library = make_box_library(Path(folder) / "library")
        track = Track(name=f"{objects}-boxes", large_obstacles=0, small_obstacles=objects - 1, goal_pairs=1)
        return GeneratedScenes(track, library, count)
