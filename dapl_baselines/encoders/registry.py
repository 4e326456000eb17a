"""Encoders by name: clouds to tokens, all with one interface."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Protocol, runtime_checkable

from jaxtyping import Float
from torch import Tensor, nn

from clutter6d.errors import UnknownNameError
from clutter6d.schema import FileModel
from dapl_baselines.encoders.dapl import DaplEncoder, DaplEncoderConfig


@runtime_checkable
class Encoder(Protocol):
    """What a policy needs to know of an encoder, which is also an ``nn.Module``.

    Attributes:
        token_count: Tokens of a cloud.
        token_size: Size of a token.
    """

    @property
    def token_count(self) -> int: ...  # noqa: D102  described by the class

    @property
    def token_size(self) -> int: ...  # noqa: D102

    def __call__(self, cloud: Float[Tensor, "row 1280 7"]) -> Float[Tensor, "row token size"]:
        """The tokens of clouds."""
        ...


@dataclass(frozen=True, kw_only=True, slots=True)
class EncoderKind:
    """How a named encoder is built.

    Attributes:
        config: Model of its configuration; its defaults are the published encoder.
        build: Configuration to module.
    """

    config: type[FileModel]
    build: Callable[[Any], nn.Module]


ENCODERS: Final[Mapping[str, EncoderKind]] = {"dapl": EncoderKind(config=DaplEncoderConfig, build=DaplEncoder)}


def find_encoder(name: str) -> EncoderKind:
    """The encoder of a name.

    Raises:
        UnknownNameError: There is none.
    """
    if name not in ENCODERS:
        raise UnknownNameError("encoder", name, ENCODERS)
    return ENCODERS[name]
