"""Trained world models, read from checkpoints; policies take the encoder alone (``policy.encoder_source``)."""

from pathlib import Path

from clutter6d.errors import InvalidFileError
from dapl_baselines.checkpoint import Checkpoint, read_checkpoint
from dapl_baselines.world_model.model import WorldModel


def load_world_model(path: Path) -> tuple[WorldModel, Checkpoint]:
    """A world model in evaluation mode, and the checkpoint it is in.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is not an acceptable checkpoint, or not of a world model.
    """
    checkpoint = read_checkpoint(path)
    if not isinstance(checkpoint.module, WorldModel):
        raise InvalidFileError(path, f"holds a {checkpoint.header.architecture}, expected a world model")
    return checkpoint.module.eval(), checkpoint
