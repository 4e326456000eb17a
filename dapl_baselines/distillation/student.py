"""The student: the paper's policy network, how it acts and how it learns."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, cast

import torch
from jaxtyping import Float, Float16, Float32
from torch import Tensor, nn
from torch.nn.functional import mse_loss, smooth_l1_loss

from dapl_baselines.distillation.settings import DistillationSettings
from dapl_baselines.encoders.point_encoder import PointEncoder
from dapl_baselines.policy.encoder_source import EncoderSource
from dapl_baselines.policy.frozen_encoder import STORED, FrozenEncoder
from dapl_baselines.policy.network import PolicyNetwork

SMOOTH_L1_BETA: Final = 0.1
"""Differences of less than this share of the action scale count squared, larger ones as they are."""

_ENCODER: Final = "encoder."


@dataclass(frozen=True, kw_only=True, slots=True)
class DistillationLosses:
    """What the student is from the teacher.

    Attributes:
        action: Smooth L1 between residuals in units of the action scale.
        latent: Mean squared error between the representations ``g``; 0 if the teacher shows none.
    """

    action: float
    latent: float


class Student:
    """A policy network that learns by imitation.

    Its critic's head learns nothing and is as it was drawn; a PPO training would have to begin with it.

    Args:
        settings: Of the distillation; its network has the encoder's configuration.
        source: The encoder.

    Attributes:
        network: The network.
    """

    def __init__(self, settings: DistillationSettings, source: EncoderSource) -> None:
        self._settings = settings
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(settings.seed)
            self.network = PolicyNetwork(settings.network)
        encoder = cast(PointEncoder, self.network.encoder)
        encoder.load_state_dict(source.module.state_dict())
        self._frozen = None
        if not settings.trains_encoder:
            self._frozen = FrozenEncoder(encoder, "cpu", getattr(torch, settings.encoder_precision))
        self._learned = [
            *self.network.trunk.parameters(),
            *(() if self.network.over_time is None else self.network.over_time.parameters()),
            *self.network.actor.parameters(),
            *(encoder.parameters() if settings.trains_encoder else ()),
        ]
        self._optimiser = torch.optim.Adam(self._learned, lr=settings.learning_rate)

    def to_stored(
        self, state: Float32[Tensor, "row state"], cloud: Float32[Tensor, "row 1280 7"]
    ) -> Float16[Tensor, "row ..."]:
        """What is kept of clouds to learn from: tokens; the clouds themselves if the encoder learns."""
        if self._frozen is None:
            return cloud.to(STORED)
        return self._frozen(cloud, state[:, self.network.config.columns_of("hand_state")])

    def fuse(self, seen: Mapping[str, Tensor]) -> Float[Tensor, "row fused"]:
        """The representation ``g``.

        Args:
            seen: ``state`` and ``stored`` of the last frames of each row, oldest first, and which of them there are, as
                :func:`take_windows` gives them.
        """
        state, stored = seen["state"].flatten(0, 1), seen["stored"].flatten(0, 1)
        look = self.network.see_tokens if self._frozen is not None else self.network.see
        frames = look(state, stored.float()).unflatten(0, seen["is_seen"].shape)
        return self.network.fuse(frames * seen["is_seen"][..., None])

    @torch.no_grad()
    def act(self, seen: Mapping[str, Tensor]) -> Float32[Tensor, "row 7"]:
        """Joint residuals [rad]; arguments as of :meth:`fuse`."""
        scale = self._settings.network.action_scale_rad
        return scale * self.network.actor(self.fuse(seen)).clamp(-1, 1)

    def update_statistics(self, state: Float32[Tensor, "row state"]) -> None:
        """Take states into the running statistics of the input."""
        self.network.trunk.statistics.update(state)

    def learn(self, batch: Mapping[str, Tensor]) -> Float32[Tensor, "2"]:
        """One step of the optimiser; returns the action and the latent loss before it.

        Args:
            batch: What is seen, as of :meth:`fuse`; the teacher's ``action`` in units of the action scale, and its
                ``latent`` if it has one.
        """
        fused = self.fuse(batch)
        action = smooth_l1_loss(self.network.actor(fused), batch["action"], beta=SMOOTH_L1_BETA)
        latent = mse_loss(fused, batch["latent"]) if "latent" in batch else action.new_zeros(())
        loss = self._settings.action_weight * action + self._settings.latent_weight * latent
        self._optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self._learned, self._settings.max_grad_norm)
        self._optimiser.step()
        return torch.stack([action, latent]).detach()

    def state_dict(self) -> dict[str, Any]:
        """Everything that changes; a frozen encoder does not."""
        weights = self.network.state_dict()
        learned = {name: value for name, value in weights.items() if self._changes(name)}
        return {"weights": learned, "optimiser": self._optimiser.state_dict()}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Go on from such a state.

        Raises:
            KeyError: Something is missing.
            RuntimeError: It is of another network.
            ValueError: It is of another optimiser.
        """
        known = {name: value for name, value in self.network.state_dict().items() if not self._changes(name)}
        self.network.load_state_dict(known | dict(state["weights"]))
        self._optimiser.load_state_dict(state["optimiser"])

    def _changes(self, name: str) -> bool:
        return self._settings.trains_encoder or not name.startswith(_ENCODER)
