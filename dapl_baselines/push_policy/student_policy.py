"""A critic of pushes that sees points alone as a policy of the evaluation."""

from collections.abc import Callable
from typing import cast

import numpy as np
import torch
from jaxtyping import Float64

from clutter6d.envs.observation import Observation
from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import PolicyInput
from dapl_baselines.policy.observation import cloud, hand_state
from dapl_baselines.push_policy.choice import choose, judge
from dapl_baselines.push_policy.policy import PushingPolicy
from dapl_baselines.push_policy.seen import Seen, see_points
from dapl_baselines.push_policy.student import PushStudent


class PushStudentPolicy(PushingPolicy):
    """The push that a critic likes best which sees points alone.

    Args:
        student: The trained network.
        policy_hash: Hash of architecture, configuration and weights.
    """

    is_privileged = False
    needs_observation = True

    def __init__(self, student: PushStudent, policy_hash: str) -> None:
        super().__init__(student.config.critic, policy_hash)
        self._student = student.eval()

    @property
    def name(self) -> str:
        """The encoder's name says which it is."""
        return f"{self._student.config.encoder.name}-pushes"

    def _see(self, inputs: PolicyInput, row: int) -> Seen:
        return see_points(row_of(inputs, row), has_normals=False)

    def _choose(
        self, inputs: PolicyInput, row: int, make_rng: Callable[[], np.random.Generator]
    ) -> Float64[np.ndarray, "1 column"]:
        observation = row_of(inputs, row)
        seen = see_points(observation)
        drawn = self._draw(seen, make_rng())
        with torch.inference_mode():
            tokens = self._student.encode(cloud(observation), hand_state(observation))
        values = judge(lambda view: self._student(view, tokens), seen.state, seen.goals, seen.shapes.surface, drawn)
        return drawn[:, choose(values, drawn, self._may_begin(int(inputs.slots[row]), seen))[0]]


def row_of(inputs: PolicyInput, row: int) -> Observation[np.ndarray]:
    """One row of what is observed.

    Raises:
        InvalidValueError: Nothing is.
    """
    if inputs.observation is None:
        raise InvalidValueError("the policy sees points: it needs an observation in its input")
    entries = cast(dict[str, np.ndarray], inputs.observation)
    return cast(Observation[np.ndarray], {name: entry[row : row + 1] for name, entry in entries.items()})
