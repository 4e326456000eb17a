"""The rows of the paper's ablation (Table "Ablation Study on Pre-training Objectives and Input Modalities")."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from clutter6d.errors import UnknownNameError
from clutter6d.schema import read_model
from dapl_baselines.encoders.dapl import DaplEncoderConfig
from dapl_baselines.tokenizer import Features
from dapl_baselines.world_model.model import Task, WorldModelConfig


def _preset(task: Task, features: Features) -> WorldModelConfig:
    return WorldModelConfig(
        task=task,
        predicts="coordinates" if task == "reconstruction" else "displacement",
        encoder=DaplEncoderConfig(features=features),
    )


PRESETS: Final[Mapping[str, WorldModelConfig]] = {
    "reconstruction-xyz": _preset("reconstruction", "xyz"),
    "reconstruction": _preset("reconstruction", "xyz_mass_velocity"),
    "object-xyz": _preset("object", "xyz"),
    "object": _preset("object", "xyz_mass_velocity"),
    "points-xyz": _preset("points", "xyz"),
    "points-xyz-velocity": _preset("points", "xyz_velocity"),
    "points": _preset("points", "xyz_mass_velocity"),
}
"""By name, in the order of the table; ``points`` is DAPL's world model."""


def find_preset(name: str) -> WorldModelConfig:
    """The configuration of a name.

    Raises:
        UnknownNameError: There is none.
    """
    if name not in PRESETS:
        raise UnknownNameError("world model preset", name, PRESETS)
    return PRESETS[name]


def find_model(choice: str) -> WorldModelConfig:
    """The configuration that an argument means: a preset's name, or a JSON file of one.

    Raises:
        UnknownNameError: There is no such preset.
        MissingFileError: There is no such file.
        InvalidFileError: It is no configuration.
    """
    if Path(choice).suffix == ".json":
        return read_model(Path(choice), WorldModelConfig, what="configuration of a world model")
    return find_preset(choice)
