"""The trained policy that a policy training begins with, in place of random weights."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from clutter6d.errors import InvalidFileError, InvalidValueError
from dapl_baselines.checkpoint import TrainingRecord, read_checkpoint, weights_sha256
from dapl_baselines.policy.config import PolicyNetworkConfig
from dapl_baselines.policy.encoder_source import EncoderSource
from dapl_baselines.policy.network import PolicyNetwork

_FREE: Final = {"encoder", "initial_std", "action_scale_rad"}
"""What the network of a training may have of its own; all else its start must have too."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PolicyStart:
    """A policy and where it comes from.

    Attributes:
        network: With its weights; its encoder is of no use here, since a training is given one.
        history: How these came about.
    """

    network: PolicyNetwork
    history: tuple[TrainingRecord, ...] = ()

    @property
    def sha256(self) -> str:
        """Hash of the weights."""
        return weights_sha256(self.network.state_dict())

    def fitted(self, config: PolicyNetworkConfig) -> PolicyNetworkConfig:
        """The configuration of a network that begins with these weights.

        What an action of 1 means goes with the weights: the action scale is that of the start.

        Args:
            config: The training's, with its encoder.

        Raises:
            InvalidValueError: The weights do not fit in it.
        """
        pairs = zip(_kind(config).items(), _kind(self.network.config).values(), strict=True)
        for (name, wanted), found in pairs:
            if wanted != found:
                raise InvalidValueError(f"{name} is {wanted}, and {found} in the policy to begin with; choose alike")
        return config.model_copy(update={"action_scale_rad": self.network.config.action_scale_rad})


def history_before(source: EncoderSource | None, start: PolicyStart | None) -> tuple[TrainingRecord, ...]:
    """How the weights came about that a training begins with: those of its start, and those of its encoder."""
    policy = () if start is None else start.history
    encoder = () if source is None else source.history
    return (*policy, *(record for record in encoder if record not in policy))


def open_start(path: Path) -> PolicyStart:
    """The policy in a checkpoint.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is not an acceptable checkpoint, or not of a policy network.
    """
    checkpoint = read_checkpoint(path)
    if not isinstance(checkpoint.module, PolicyNetwork):
        raise InvalidFileError(path, f"holds a {checkpoint.header.architecture}, expected a policy network")
    return PolicyStart(network=checkpoint.module, history=checkpoint.header.history)


def _kind(config: PolicyNetworkConfig) -> dict[str, object]:
    """What must be alike in two networks if one is to have the other's weights."""
    values: dict[str, object] = {name: value for name, value in config if name not in _FREE}
    return {**values, "size of tokens": config.encoder and config.encoder.token_size}
