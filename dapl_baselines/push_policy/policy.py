"""Policies that choose a push, carry it out, and choose the next one."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int

from clutter6d.envs.action import ActionConfig
from clutter6d.eval.policy import Episode, PolicyInput
from clutter6d.seeding import generator
from dapl_baselines.push_policy.candidates import Counts, draw_candidates
from dapl_baselines.push_policy.choice import MayBegin
from dapl_baselines.push_policy.critic import PushCriticConfig
from dapl_baselines.push_policy.seen import Seen
from dapl_baselines.push_policy.tracker import PushTracker

FIRST: Final = np.zeros(1, dtype=np.int64)
"""The only row: slots are seen, judged and moved one by one, since larger products differ in their last bits."""


class Slot:
    """What is remembered of an episode.

    Args:
        episode: The episode; ``None`` on a robot, where nobody knows of any.

    Attributes:
        episode: The episode.
        tracker: The push that is carried out.
    """

    def __init__(self, episode: Episode | None) -> None:
        self.episode, self.tracker = episode, PushTracker(size=1)

    def rng(self, step: int) -> np.random.Generator:
        """Where everything is drawn from at a step."""
        episode = self.episode
        if episode is None:
            return generator(0, "pushes", step)
        return generator(episode.seed, "pushes", episode.scene.scene_id, episode.pair_index, step)


class PushingPolicy(ABC):
    """Carries out the pushes that a subclass chooses among those drawn by episode and step.

    Args:
        config: How many are drawn.
        policy_hash: Hash of architecture, configuration and weights.
    """

    def __init__(self, config: PushCriticConfig, policy_hash: str) -> None:
        self.policy_hash = policy_hash
        self._counts = Counts(segments=config.segments, whole=config.whole_pushes)
        self._slots: dict[int, Slot] = {}

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:
        """Forget the pushes of slots in which episodes start."""
        for slot, episode in zip(slots.tolist(), episodes or [None] * len(slots), strict=True):
            self._slots[slot] = Slot(episode)

    def act(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
        """Joint residuals [rad].

        Raises:
            InvalidValueError: The input lacks what the policy needs.
        """
        residuals: list[np.ndarray] = []
        for row, (number, step) in enumerate(zip(inputs.slots.tolist(), inputs.steps.tolist(), strict=True)):
            slot = self._slots[number]
            seen = self._see(inputs, row)
            if slot.tracker.is_over()[0]:
                push = self._choose(inputs, row, partial(slot.rng, step))
                slot.tracker.begin(FIRST, push, seen.state.poses[:, :3])
            around = seen.points_in_the_way()
            residuals.append(slot.tracker.residuals(seen.hand, seen.qpos, seen.qvel, around, ActionConfig()))
        return np.concatenate(residuals).astype(np.float32)

    def _draw(self, seen: Seen, rng: np.random.Generator) -> Float64[np.ndarray, "1 push column"]:
        """The pushes that are chosen among."""
        return draw_candidates(seen.state, seen.goals, seen.shapes, seen.targets, self._counts, rng)

    def _may_begin(self, slot: int, seen: Seen) -> MayBegin:
        """Tells which of some pushes can begin in a slot."""
        tracker, around, origins = self._slots[slot].tracker, seen.points_in_the_way()[0], seen.state.poses[0, :3]

        def may_begin(pushes: Float64[np.ndarray, "push column"]) -> Bool[np.ndarray, "push"]:
            count = len(pushes)
            places = np.broadcast_to(origins, (count, 3)), np.broadcast_to(around, (count, *around.shape))
            return tracker.may_begin(np.zeros(count, dtype=np.int64), pushes, *places)

        return may_begin

    @abstractmethod
    def _see(self, inputs: PolicyInput, row: int) -> Seen:
        """What is known of a row of the input, as far as it takes to carry a push out."""

    @abstractmethod
    def _choose(
        self, inputs: PolicyInput, row: int, make_rng: Callable[[], np.random.Generator]
    ) -> Float64[np.ndarray, "1 column"]:
        """The push that is carried out next; each generator made is the same."""
