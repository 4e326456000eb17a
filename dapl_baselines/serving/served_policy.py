"""What the server asks: one observation to one action, for each client on its own."""

from collections.abc import Mapping
from pathlib import Path
from typing import Protocol, cast, runtime_checkable

import numpy as np
from jaxtyping import Float32

from clutter6d.envs.observation import OBSERVATION_SHAPES, Observation
from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import Policy, PolicyInput, blaming
from clutter6d.eval.policy_loading import load_policy

Entries = Mapping[str, Float32[np.ndarray, "..."]]
"""An observation of one robot, without a batch axis."""


@runtime_checkable
class ServedPolicy(Protocol):
    """A policy as the server knows it."""

    @property
    def name(self) -> str:
        """Its name."""
        ...

    @property
    def policy_hash(self) -> str:
        """SHA-256 over everything its actions depend on."""
        ...

    @property
    def fields(self) -> tuple[str, ...]:
        """The entries of the observation that it takes."""
        ...

    @property
    def action_scale_rad(self) -> float | None:
        """No residual is larger [rad]; ``None`` if unknown."""
        ...

    def begin(self, slot: int) -> None:
        """An episode starts in a slot."""
        ...

    def act(self, slot: int, observation: Entries) -> Float32[np.ndarray, "7"]:
        """Joint residuals [rad]."""
        ...


class EvaluatedPolicy:
    """A policy of the evaluation, served: the same code, so the same actions to the bit.

    Args:
        policy: It must act on observations alone.

    Raises:
        InvalidValueError: It sees the simulator's state.
    """

    action_scale_rad: float | None = None

    def __init__(self, policy: Policy) -> None:
        if policy.is_privileged:
            raise InvalidValueError(f"policy '{policy.name}' sees the simulator's state, which a robot has not")
        self._policy, self._steps = policy, dict[int, int]()
        self.name, self.policy_hash = policy.name, policy.policy_hash
        self.fields = tuple(OBSERVATION_SHAPES) if policy.needs_observation else ()

    def begin(self, slot: int) -> None:
        """An episode starts in a slot; there is no scene to tell the policy of."""
        self._steps[slot] = 0
        with blaming(f"policy '{self.name}'"):
            self._policy.begin(np.array([slot]), ())

    def act(self, slot: int, observation: Entries) -> Float32[np.ndarray, "7"]:
        """Joint residuals [rad].

        Raises:
            InvalidValueError: The policy failed, as one does that needs to know the scene.
        """
        rows = cast(Observation, {name: observation[name][None].copy() for name in self.fields})
        inputs = PolicyInput(
            slots=np.array([slot]),
            episodes=(),
            steps=np.array([self._steps[slot]]),
            observation=rows if self.fields else None,
            states=None,
        )
        self._steps[slot] += 1
        with blaming(f"policy '{self.name}' cannot be served: it"):
            return self._policy.act(inputs)[0]


def open_policy(spec: str) -> ServedPolicy:
    """The policy that an argument means.

    Args:
        spec: A folder made by ``dapl export``, or what ``clutter6d evaluate --policy`` takes.

    Raises:
        UserError: There is no such policy, or it cannot be served.
    """
    if Path(spec).is_dir():
        from dapl_baselines.serving.onnx_policy import OnnxPolicy  # only here is ONNX Runtime needed

        return OnnxPolicy(Path(spec))
    return EvaluatedPolicy(load_policy(spec))


def try_out(policy: ServedPolicy) -> None:
    """Ask a policy once, before anyone does: one that cannot be served says so now, and what is compiled is compiled.

    Raises:
        InvalidValueError: It cannot be served.
    """
    policy.begin(0)
    policy.act(0, {name: np.zeros(shape, dtype=np.float32) for name, shape in OBSERVATION_SHAPES.items()})
