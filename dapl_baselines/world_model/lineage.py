"""How the weights of a world model came about: what it begins with, and what a training adds to its history."""

from clutter6d.errors import InvalidValueError
from dapl_baselines.checkpoint import Checkpoint, TrainingRecord
from dapl_baselines.code_hash import code_sha256
from dapl_baselines.interactions.dataset import InteractionData
from dapl_baselines.world_model.train_config import RunConfig


def begun_with(start: Checkpoint, config: RunConfig) -> RunConfig:
    """The configuration of a training that begins with a trained world model.

    Raises:
        InvalidValueError: That is another model.
    """
    if start.header.config != config.model.model_dump(mode="json"):
        raise InvalidValueError("the world model to begin with has another configuration; train the same model on")
    return config.model_copy(update={"start_sha256": start.header.weights_sha256})


def training_record(config: RunConfig, data: InteractionData, step: int) -> TrainingRecord:
    """What a training is, up to a step."""
    splits = {header.split_sha256 for header in data.headers}
    return TrainingRecord(
        method="world-model",
        steps=step,
        unit="optimiser steps",
        seed=config.train.seed,
        split_sha256=splits.pop() if len(splits) == 1 else "",
        code_sha256=code_sha256(),
        settings=config.model_dump(mode="json"),
    )
