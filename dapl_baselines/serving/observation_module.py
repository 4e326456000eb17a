"""A checkpoint's network behind one interface: the entries of an observation in, joint residuals out.

A network with a history takes what it remembers after the entries, and gives what it will remember after the residuals.
"""

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
from dapl_baselines.serving.manifest import memory_spec


class ObservationModule(nn.Module):
    """Takes the entries of an observation one by one, as a runtime without our code hands them over.

    Args:
        network: The network.

    Attributes:
        fields: The entries of the observation that it takes, in this order.
        name: The policy's name in tables.
        action_scale_rad: No residual is larger [rad].
        memory: What it remembers of an episode, zeros at its start; ``None``: nothing.
    """

    def __init__(self, network: PolicyNetwork) -> None:
        super().__init__()
        state_parts = network.config.state_parts
        self.network = network
        self.fields: tuple[str, ...] = (*state_parts, *(CLOUD_PARTS if network.encoder is not None else ()))
        self.name = NetworkPolicy(network, "").name
        self.action_scale_rad = network.config.action_scale_rad
        self.memory = memory_spec(network.config.history - 1, network.frame_size)
        self._states = len(state_parts)

    def forward(
        self, *entries: Float[Tensor, "row ..."]
    ) -> Float[Tensor, "row 7"] | tuple[Float[Tensor, "row 7"], Float[Tensor, "row past frame"]]:
        """The residuals of each row [rad]; with a memory, it after this step too.

        Args:
            entries: As named by ``fields``; then the memory, if there is one.
        """
        seen = entries[: len(self.fields)]
        parts = [torch.cat(seen[: self._states], dim=1)]
        if len(seen) > self._states:
            parts.append(torch.cat(seen[self._states :], dim=1))
        if self.memory is None:
            return self.network(*parts)
        window = self.network.window(self.network.see(*parts), entries[-1])
        return self.network.act(window), window[:, 1:]


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
