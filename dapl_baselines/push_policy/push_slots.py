"""Episodes that run side by side to be learned from: pushes are given to slots and carried out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import torch
from jaxtyping import Bool, Int

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.episode_streams import EpisodeStreams, StreamPlaces
from clutter6d.envs.episodes import EpisodeSlots, StepResult
from clutter6d.envs.observation import BodyState, Observation
from clutter6d.envs.slots import Motion, Slots
from clutter6d.envs.tasks import TaskSource
from clutter6d.seeding import seed_words
from clutter6d.sim.model_variation import let_sleep
from dapl_baselines.policy.episode_tally import EpisodeTally
from dapl_baselines.push_policy.push_state import SceneFacts
from dapl_baselines.push_policy.seen import Seen, see_states
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.push_policy.tracker import PushTracker
from dapl_baselines.validation import SceneSubset

LOST_M: Final = np.array([0.48, 0.68])
"""A target beyond these |x|, |y|, 2 cm from the table's edge, is taken for dropped: nothing is learned from there."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Ends:
    """What a control step ended; one entry a slot.

    Attributes:
        is_success: Episodes that are at the goal.
        is_drop: Episodes in which an object has fallen, or the physics became invalid.
        is_over: Episodes that are over, by these or by time.
        push: Pushes that are over, by themselves or with their episodes.
    """

    is_success: Bool[np.ndarray, "slot"]
    is_drop: Bool[np.ndarray, "slot"]
    is_over: Bool[np.ndarray, "slot"]
    push: Bool[np.ndarray, "slot"]


class PushSlots:
    """Slots on scenes whose objects may sleep.

    Args:
        scenes: What is trained on.
        shapes: Shapes of all their targets.
        config: Of the environment.
        size: Slots.
        seed: Of the episodes that are drawn.
        threads: Threads of the simulation; 0 for all cores.

    Attributes:
        tracker: What is carried out.
    """

    def __init__(
        self, scenes: SceneSubset, shapes: TargetShapes, config: EnvConfig, *, size: int, seed: int, threads: int = 0
    ) -> None:
        self._shapes, self._config, self._all = shapes, config, np.arange(size)
        source = TaskSource(scenes, kept_models=len(scenes.scenes), prepare=let_sleep)
        self._streams = EpisodeStreams(source, size, config)
        self._streams.seed([seed_words(seed, "push slot", slot)[0] for slot in range(size)])
        self._episodes = EpisodeSlots(self._streams, config, threads=threads)
        self._facts = SceneFacts.of([task.model for task in self._streams.tasks])
        self.targets = np.zeros(size, dtype=np.int64)
        self.tracker, self.tally = PushTracker(size=size), EpisodeTally(size, torch.device("cpu"))
        self.begin(self._all)

    @property
    def steps(self) -> Int[np.ndarray, "slot"]:
        """Control steps that the episodes have made."""
        return self._episodes.core.steps

    @property
    def places(self) -> StreamPlaces:
        """Which episodes the slots run."""
        return self._streams.places

    def see(self) -> Seen:
        """All slots, as the simulation knows them."""
        batch = self._episodes.core.batch
        bodies = BodyState(
            arm_qpos=batch.arm_qpos,
            arm_qvel=batch.arm_qvel,
            object_poses=batch.object_poses,
            object_velocities=batch.object_velocities,
        )
        return see_states(bodies, self._episodes.core.goals, self._facts, self._shapes, self.targets)

    def observe(self, slots: Slots) -> Observation[np.ndarray]:
        """Slots, as a policy sees them that is not privileged."""
        return self._episodes.core.observe(slots)

    def step(self, seen: Seen, counted: Bool[np.ndarray, "slot"]) -> Ends:
        """Carry all pushes on by one control step.

        Args:
            seen: All slots, as they are.
            counted: Slots whose episodes are counted in the tally.
        """
        around = seen.points_in_the_way()
        residuals = self.tracker.residuals(seen.hand, seen.qpos, seen.qvel, around, self._config.action)
        result = self._episodes.step(self._all, residuals.astype(np.float32))
        ends = self._ends(result)
        flags = (torch.from_numpy(flag) for flag in (ends.is_over & counted, ends.is_success))
        self.tally.add(torch.from_numpy(np.asarray(result.reward.total) * counted), *flags)
        return ends

    def begin(self, slots: Slots, chosen: Sequence[tuple[str, int]] | None = None) -> None:
        """Start the next episodes of slots."""
        self._episodes.begin(slots, chosen)
        self._read_facts(slots)
        self.tracker.forget(slots)

    def pause(self) -> Motion:
        """Where the episodes are; whoever goes on from here and whoever is put back to here goes on alike.

        Who sleeps is not part of a state, so all are woken up.
        """
        motion = self._episodes.core.motion
        self._episodes.core.take_up(motion)
        return motion

    def return_to(self, places: StreamPlaces, motion: Motion) -> None:
        """Go on with the episodes that ran when these were read."""
        self._episodes.return_to(places, motion)
        self._read_facts(self._all)

    def _ends(self, result: StepResult) -> Ends:
        xy = np.abs(self._episodes.core.batch.object_poses[:, 0, :2])
        is_success = np.array([outcome == "success" for outcome in result.outcomes])
        is_drop = np.array([outcome in ("drop", "unstable") for outcome in result.outcomes])
        is_drop |= (xy > LOST_M).any(axis=1) & ~is_success
        is_over = is_success | is_drop | np.array([outcome == "timeout" for outcome in result.outcomes])
        push = self.tracker.is_over() | is_over
        return Ends(is_success=is_success, is_drop=is_drop, is_over=is_over, push=push)

    def _read_facts(self, slots: Slots) -> None:
        models = [self._streams.tasks[slot].model for slot in slots]
        self._facts.put(slots, SceneFacts.of(models))
        self.targets[slots] = self._shapes.rows_of([model.assets[0] for model in models])
