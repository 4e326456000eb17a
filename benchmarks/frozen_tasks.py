"""Tasks of the frozen data set, each a scene and a goal pair of its own, compiled."""

from dataclasses import dataclass

import numpy as np
from bars import bar

from clutter6d.dataset.scenes import load_split
from clutter6d.scene import GoalPair
from clutter6d.sim.scene_model import SceneModel, compile_stored_scene

SPLITS = {"sparse": "sparse-train", "moderate": "moderate-test", "dense": "dense-test"}
"""The largest frozen split of each track."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Tasks:
    """Compiled scenes and one goal pair of each, in the same order."""

    models: list[SceneModel]
    pairs: list[GoalPair]

    @property
    def object_count(self) -> int:
        """Objects of every scene."""
        return self.models[0].object_count

    @property
    def object_poses(self) -> np.ndarray:
        """Poses of all objects at the start, one row a task."""
        return np.stack([pair.object_poses for pair in self.pairs])

    def __len__(self) -> int:
        return len(self.models)

    def head(self, count: int) -> "Tasks":
        """The first tasks."""
        return Tasks(models=self.models[:count], pairs=self.pairs[:count])


def load_tasks(split: str, count: int) -> Tasks:
    """The first scenes of a split, each with another of its goal pairs; a short split is gone through again."""
    found = load_split(split)
    models: list[SceneModel] = []
    pairs: list[GoalPair] = []
    for number in bar(range(count), f"compiling {split}"):
        scene = found[number % len(found)]
        again = number >= len(found)
        models.append(models[number - len(found)] if again else compile_stored_scene(scene, found.assets_of(scene)))
        pairs.append(scene.goal_pairs[(number + number // len(found)) % len(scene.goal_pairs)])
    return Tasks(models=models, pairs=pairs)
