"""A few scenes of a set, drawn at random and the same for everyone: what a person attempts.

The paper draws 10 scenes of each track for its human operator. Which ones depends on the set of scenes and on nothing
else, so that a policy's row on the sample stands beside a person's. A smaller sample is part of every larger one.
"""

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.errors import InvalidValueError
from clutter6d.seeding import generator

PAPER_SAMPLE = 10
"""Scenes of each track that the paper's operator attempted."""


def sample_scene_ids(scenes: SceneCollection, count: int) -> tuple[str, ...]:
    """Names of the scenes in the sample, sorted.

    Args:
        scenes: The scenes to draw from; the draw depends on their SHA-256 alone.
        count: How many.

    Raises:
        InvalidValueError: There are not so many scenes.
    """
    names = sorted(scene.scene_id for scene in scenes.scenes)
    if not 1 <= count <= len(names):
        raise InvalidValueError(f"sample is {count}, but there are {len(names)} scenes; choose 1 to {len(names)}")
    order = generator(0, "evaluation_sample", scenes.sha256).permutation(len(names))
    return tuple(sorted(names[index] for index in order[:count]))
