"""Which scenes trainings may use, and which they are watched on: the one definition for every training here.

The last sixteenth of the scenes is never trained on: of ``sparse-train``, the last 64 of 1,024. Test splits are refused
altogether, under any name.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from clutter6d.assets.asset import Asset
from clutter6d.dataset.dataset import dataset_names, open_dataset
from clutter6d.dataset.scenes import SceneCollection, open_scenes
from clutter6d.errors import InvalidValueError
from clutter6d.scene import Scene

VALIDATION_SHARE: Final = 16
"""One scene of so many is held out."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SceneSubset:
    """Some scenes of a collection; a collection itself.

    Attributes:
        whole: Where they are from.
        scenes: Which.
    """

    whole: SceneCollection
    scenes: tuple[Scene, ...]

    @property
    def sha256(self) -> str:
        """Names exactly this set of scenes."""
        names = "\n".join(scene.scene_id for scene in self.scenes)
        return hashlib.sha256(f"{self.whole.sha256}\n{names}".encode()).hexdigest()

    def assets_of(self, scene: Scene) -> Mapping[str, Asset]:
        """The assets of a scene by content hash."""
        return self.whole.assets_of(scene)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TrainingScenes:
    """The scenes of a training.

    Attributes:
        training: What it may use.
        validation: What it is watched on.
    """

    training: SceneSubset
    validation: SceneSubset


def open_training_scenes(name_or_folder: str | Path) -> TrainingScenes:
    """The scenes of a split or folder, parted.

    Raises:
        InvalidValueError: They are a test split's, or too few.
        MissingFileError: There is no such folder.
        UnknownNameError: There is no such split.
    """
    return part_scenes(open_scenes(name_or_folder))


def part_scenes(collection: SceneCollection) -> TrainingScenes:
    """Hold the last sixteenth of the scenes out, at least one.

    Raises:
        InvalidValueError: They are a test split's, or too few.
    """
    test = _test_splits().get(collection.sha256)
    if test is not None:
        raise InvalidValueError(f"these are the scenes of {test}; train on sparse-train or on scenes of your own")
    scenes = collection.scenes
    if len(scenes) < 2:
        raise InvalidValueError(f"{len(scenes)} scenes are too few to train on: one is held out; give at least 2")
    held_out = max(1, len(scenes) // VALIDATION_SHARE)
    return TrainingScenes(
        training=SceneSubset(whole=collection, scenes=scenes[:-held_out]),
        validation=SceneSubset(whole=collection, scenes=scenes[-held_out:]),
    )


def _test_splits() -> dict[str, str]:
    """The frozen test splits by the hash of their scenes."""
    return {
        entry.scenes_sha256: entry.name
        for dataset in dataset_names()
        for entry in open_dataset(dataset).manifest.splits
        if entry.name.endswith("-test")
    }
