"""Encoders by name: clouds and hand poses to tokens, all with one interface."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final

from pydantic import Field

from clutter6d.errors import UnknownNameError
from dapl_baselines.encoders.corn import CornEncoder, CornEncoderConfig
from dapl_baselines.encoders.dapl import DaplEncoder, DaplEncoderConfig
from dapl_baselines.encoders.point_encoder import PointEncoder

EncoderConfig = Annotated[DaplEncoderConfig | CornEncoderConfig, Field(discriminator="name")]
"""The configuration of any encoder, which says by its name of which."""


@dataclass(frozen=True, kw_only=True, slots=True)
class EncoderKind:
    """How a named encoder is built.

    Attributes:
        config: Model of its configuration; its defaults are the published encoder.
        build: Configuration to module.
    """

    config: type[DaplEncoderConfig] | type[CornEncoderConfig]
    build: Callable[[Any], PointEncoder]


ENCODERS: Final[Mapping[str, EncoderKind]] = {
    "dapl": EncoderKind(config=DaplEncoderConfig, build=DaplEncoder),
    "corn": EncoderKind(config=CornEncoderConfig, build=CornEncoder),
}


def find_encoder(name: str) -> EncoderKind:
    """The encoder of a name.

    Raises:
        UnknownNameError: There is none.
    """
    if name not in ENCODERS:
        raise UnknownNameError("encoder", name, ENCODERS)
    return ENCODERS[name]


def make_encoder(config: EncoderConfig) -> PointEncoder:
    """The encoder of a configuration, with random weights."""
    return find_encoder(config.name).build(config)
