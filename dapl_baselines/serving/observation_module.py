"""A checkpoint's network behind one interface: the entries of an observation in, joint residuals out."""

from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor, nn

from clutter6d.envs.observation import OBSERVATION_SHAPES
from clutter6d.errors import InvalidFileError
from dapl_baselines.checkpoint import read_checkpoint
from dapl_baselines.policy.network import PolicyNetwork
from dapl_baselines.policy.observation import CLOUD_PARTS
from dapl_baselines.policy.policy import NetworkPolicy


class ObservationModule(nn.Module):
    """Takes the entries of an observation one by one, as a runtime without our code hands them over.

    Args:
        network: The network.

    Attributes:
        fields: The entries of the observation that it takes, in this order.
        name: The policy's name in tables.
        action_scale_rad: No residual is larger [rad].
    """

    def __init__(self, network: PolicyNetwork) -> None:
        super().__init__()
        state_parts = network.config.state_parts
        self.network = network
        self.fields: tuple[str, ...] = (*state_parts, *(CLOUD_PARTS if network.encoder is not None else ()))
        self.name = NetworkPolicy(network, "").name
        self.action_scale_rad = network.config.action_scale_rad
        self._states = len(state_parts)

    def forward(self, *entries: Float[Tensor, "row ..."]) -> Float[Tensor, "row 7"]:
        """The residuals of each row [rad].

        Args:
            entries: As named by ``fields``.
        """
        parts = [torch.cat(entries[: self._states], dim=1)]
        if len(entries) > self._states:
            parts.append(torch.cat(entries[self._states :], dim=1))
        return self.network(*parts)


def read_observation_module(path: Path) -> tuple[ObservationModule, str]:
    """The network of a checkpoint, ready to be exported, and its policy's hash.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is not acceptable, is no policy, or one that sees what only a simulation knows.
    """
    checkpoint = read_checkpoint(path)
    network = checkpoint.module.eval().requires_grad_(False)
    if not isinstance(network, PolicyNetwork):
        raise InvalidFileError(path, f"holds a {checkpoint.header.architecture}, which is no policy")
    hidden = [part for part in network.config.state_parts if part not in OBSERVATION_SHAPES]
    if hidden:
        raise InvalidFileError(path, f"needs {', '.join(hidden)}, which only a simulation knows; export its student")
    return ObservationModule(network), checkpoint.header.policy_hash()
