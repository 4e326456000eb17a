"""A trained policy network as a policy of the evaluation."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32, Float64, Int
from torch import Tensor

from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import Episode, PolicyInput
from dapl_baselines.fixed_batches import forward_in_fixed_batches
from dapl_baselines.policy.frame_memory import FrameMemory
from dapl_baselines.policy.network import PolicyNetwork
from dapl_baselines.policy.observation import cloud, object_states, state_vector


class NetworkPolicy:
    """Acts by the most likely action; remembers the frames of each slot by itself, if the network has a history.

    Args:
        network: The trained network.
        policy_hash: Hash of architecture, configuration and weights.
    """

    needs_observation = True

    def __init__(self, network: PolicyNetwork, policy_hash: str) -> None:
        self.policy_hash = policy_hash
        self._network, self._config = network.eval(), network.config
        self._memory = FrameMemory(self._config.history, network.frame_size)

    @property
    def name(self) -> str:
        """The encoder's name says which it is."""
        return f"{self._config.encoder.name}-policy" if self._config.encoder else "state-policy"

    @property
    def is_privileged(self) -> bool:
        """Whether it sees what only a simulation knows."""
        return self._config.is_privileged

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:  # noqa: ARG002
        """Forget the frames of the episodes before."""
        self._memory.forget(slots)

    def act(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
        """Joint residuals [rad]."""
        return forward_in_fixed_batches(self._network.act, self._window(inputs))

    @property
    def latent_size(self) -> int:
        """Numbers in ``g``."""
        return self._config.fusion_sizes[-1]

    def latents(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot fused"]:
        """The representation ``g`` that the actions are read from, which a student may learn to recover."""
        return forward_in_fixed_batches(self._network.fuse, self._window(inputs))

    def _window(self, inputs: PolicyInput) -> Float32[Tensor, "slot history frame"]:
        """The last frames of each slot, that of this observation among them."""
        frames = forward_in_fixed_batches(self._network.see, *self._network_inputs(inputs))
        return self._memory.remember(inputs.slots, inputs.steps, frames)

    def _network_inputs(self, inputs: PolicyInput) -> list[Tensor]:
        seen: dict[str, object] = dict(inputs.observation or {})
        if inputs.states is not None and self._config.objects:
            seen["object_states"] = self._object_states(inputs.states, inputs.episodes)
        network_inputs = [state_vector(seen, self._config.state_parts)]
        if self._config.encoder:
            network_inputs.append(cloud(seen))
        return network_inputs

    def _object_states(
        self, states: Float64[np.ndarray, "slot state"], episodes: Sequence[Episode]
    ) -> Float32[np.ndarray, "slot object 15"]:
        scenes = [episode.scene_model for episode in episodes]
        found, known = scenes[0].object_count, self._config.objects
        if found != known:
            raise InvalidValueError(f"the policy knows scenes of {known} objects, these have {found}; choose others")
        return object_states(states, scenes)
