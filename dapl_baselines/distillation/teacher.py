"""What a student is told at every state it visits: the teacher's action and, if it has one, its latent."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import torch
from jaxtyping import Float32
from torch import Tensor

from clutter6d.envs.action import ACTION_SIZE
from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import Policy, PolicyInput, ask_policy


@runtime_checkable
class HasLatents(Protocol):
    """A policy that shows the representation its actions are read from."""

    @property
    def latent_size(self) -> int:
        """Numbers in it."""
        ...

    def latents(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot latent"]:
        """It, of each slot."""
        ...


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Labels:
    """What the teacher says of one step of all environments.

    Attributes:
        actions: Joint residuals [rad].
        latents: Its latent; ``None`` if that is not learned from.
    """

    actions: Float32[Tensor, "env 7"]
    latents: Float32[Tensor, "env latent"] | None

    def fields(self, action_scale_rad: float) -> dict[str, Tensor]:
        """As it is learned from: ``action`` in units of the action scale, and ``latent`` if there is one."""
        action = {"action": (self.actions / action_scale_rad).clamp(-1, 1)}
        return action if self.latents is None else action | {"latent": self.latents}


class Teacher:
    """A policy as the teacher of a distillation.

    Args:
        policy: Any; its latent is learned from if it is a policy network of ours or has one of its own.
        student_latent_size: Size of the student's ``g``.
        learns_latents: Whether a latent is wanted.

    Attributes:
        policy: The policy.
        latent_size: Numbers in the latents that are learned from; 0: none are.

    Raises:
        InvalidValueError: Its latent is of another size than the student's.
    """

    def __init__(self, policy: Policy, *, student_latent_size: int, learns_latents: bool) -> None:
        self.policy, self.latent_size = policy, 0
        self._source = policy if learns_latents and isinstance(policy, HasLatents) else None
        if self._source is None:
            return
        self.latent_size = self._source.latent_size
        if self.latent_size != student_latent_size:
            raise InvalidValueError(
                f"the latent of teacher '{policy.name}' has {self.latent_size} numbers, the student's "
                f"{student_latent_size}; give --latent-weight 0 to learn its actions alone"
            )

    def blank(self, rows: int) -> Labels:
        """Labels of so many environments that say nothing, for their sizes."""
        latents = torch.zeros(rows, self.latent_size) if self.latent_size else None
        return Labels(actions=torch.zeros(rows, ACTION_SIZE), latents=latents)

    def label(self, inputs: PolicyInput) -> Labels:
        """What it would do, and its latent.

        Raises:
            InvalidValueError: It gave something else than finite float32 residuals, or failed.
        """
        actions = torch.from_numpy(ask_policy(self.policy, inputs).copy())
        latents = None if self._source is None else torch.from_numpy(self._source.latents(inputs))
        return Labels(actions=actions, latents=latents)
