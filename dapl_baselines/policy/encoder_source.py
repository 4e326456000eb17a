"""The frozen encoder that a policy training starts from."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final, cast

import torch

from clutter6d.errors import InvalidFileError, InvalidValueError, UnknownNameError
from dapl_baselines.bundled import BUNDLED, open_checkpoint
from dapl_baselines.checkpoint import TrainingRecord, weights_sha256
from dapl_baselines.encoders.point_encoder import PointEncoder
from dapl_baselines.encoders.registry import ENCODERS, EncoderConfig, make_encoder

NO_ENCODER: Final = "none"


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class EncoderSource:
    """An encoder and where it comes from.

    Attributes:
        config: Its configuration.
        module: With its weights.
        history: How these came about; empty for random ones.
    """

    config: EncoderConfig
    module: PointEncoder
    history: tuple[TrainingRecord, ...] = ()

    @property
    def sha256(self) -> str:
        """Hash of the weights."""
        return weights_sha256(self.module.state_dict())


def open_encoder(choice: str, seed: int) -> EncoderSource | None:
    """The encoder that an argument means.

    Args:
        choice: ``"none"``; an encoder's name, for one with random weights (as the paper's first policy has); or a
            checkpoint of a world model or policy, by its file or, of one that comes with the package, its name.
        seed: Of random weights.

    Raises:
        UnknownNameError: Neither a name nor a ``.pt`` file.
        MissingFileError: There is no such file.
        InvalidFileError: It is not an acceptable checkpoint, or holds no encoder.
    """
    if choice == NO_ENCODER:
        return None
    if choice in BUNDLED or Path(choice).suffix == ".pt":
        return _read_encoder(choice)
    if choice not in ENCODERS:
        raise UnknownNameError("encoder", choice, [NO_ENCODER, *ENCODERS, *BUNDLED, "checkpoint.pt"])
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        config = ENCODERS[choice].config()
        return EncoderSource(config=config, module=make_encoder(config))


def open_point_encoder(choice: str, seed: int) -> EncoderSource:
    """The encoder of a student; arguments and errors as of :func:`open_encoder`.

    Raises:
        InvalidValueError: There is none.
    """
    source = open_encoder(choice, seed)
    if source is None:
        raise InvalidValueError(
            "a student sees points; give --encoder dapl, corn or the .pt of a world model or policy"
        )
    return source


def _read_encoder(name_or_file: str) -> EncoderSource:
    checkpoint = open_checkpoint(name_or_file)
    encoder = getattr(checkpoint.module, "encoder", None)
    if not isinstance(encoder, PointEncoder):
        raise InvalidFileError(name_or_file, f"holds a {checkpoint.header.architecture} without a point encoder")
    return EncoderSource(config=cast(EncoderConfig, encoder.config), module=encoder, history=checkpoint.header.history)
