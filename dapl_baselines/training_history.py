"""What a checkpoint tells of the training that made it."""

from typing import cast

from pydantic import JsonValue

from clutter6d.schema import FileModel
from dapl_baselines.checkpoint import TrainingRecord
from dapl_baselines.code_hash import code_sha256
from dapl_baselines.validation import TrainingScenes


def environment_record(
    method: str, *, steps: int, seed: int, scenes: TrainingScenes, settings: FileModel, **more: JsonValue
) -> TrainingRecord:
    """The record of a stretch of training in environments, by the code that runs.

    Args:
        method: How it was trained.
        steps: Environment steps.
        seed: Of the training.
        scenes: What was trained on.
        settings: Of the training.
        more: What else the settings do not say.
    """
    return TrainingRecord(
        method=method,
        steps=steps,
        unit="environment steps",
        seed=seed,
        split_sha256=scenes.training.sha256,
        code_sha256=code_sha256(),
        settings=cast(dict[str, JsonValue], settings.model_dump(mode="json")) | more,
    )
