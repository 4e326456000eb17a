"""Episodes in slots: which task each slot runs, what it sees, and how it ends."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, cast

import numpy as np
from jaxtyping import Float32

from clutter6d.envs.cameras import CameraRig
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.episode_streams import EpisodeStarts, EpisodeStreams, StreamPlaces
from clutter6d.envs.reward import RewardTerms
from clutter6d.envs.slots import ClutterSlots, Motion, Slots
from clutter6d.envs.termination import GoalErrors, Outcome, find_outcome, is_at_goal
from clutter6d.envs.unstable_state import report_unstable
from clutter6d.sim.scene_model import joint_state

MIN_KEPT_SCENES: Final = 64
"""Scenes that cameras keep ready at least."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StepResult:
    """What came of one control step; row ``i`` belongs to the ``i``-th slot that was stepped.

    Attributes:
        reward: The reward's terms.
        errors: How far the targets are from their goals.
        outcomes: How the episode ended, or ``None`` while it goes on.
    """

    reward: RewardTerms
    errors: GoalErrors
    outcomes: tuple[Outcome | None, ...]


class EpisodeSlots:
    """Slots that run one episode after another.

    Args:
        streams: The episodes of each slot.
        config: Actions, observation, physics, reward and termination.
        threads: Threads of simulation and observation; 0 for all cores.
        unstable_dir: Where the state before an invalid step is kept.

    Attributes:
        core: The simulation.
    """

    def __init__(
        self, streams: EpisodeStreams, config: EnvConfig, *, threads: int = 0, unstable_dir: Path | None = None
    ) -> None:
        self._streams, self._unstable_dir = streams, unstable_dir
        self.core = ClutterSlots([task.model for task in streams.tasks], config, threads=threads)
        kept = max(self.core.size, MIN_KEPT_SCENES)
        self._rig = CameraRig(config.cameras, kept_scenes=kept) if config.cameras else None

    def begin(self, slots: Slots, chosen: Sequence[tuple[str, int]] | None = None) -> None:
        """Start the next episode of slots; arguments and errors as :meth:`EpisodeStreams.advance`."""
        self._load(slots, self._streams.advance(slots, chosen))

    def return_to(self, places: StreamPlaces, motion: Motion) -> None:
        """Go on with the episodes that ran when these were read; errors as of the two methods called."""
        self._load(np.arange(self.core.size), self._streams.return_to(places))
        self.core.take_up(motion)

    def step(self, slots: Slots, actions: Float32[np.ndarray, "slot action"]) -> StepResult:
        """Advance slots by one control step; a slot whose step is invalid keeps the state before."""
        is_unstable = self.core.step(slots, actions)
        for slot in slots[is_unstable]:
            self._report(int(slot))
        errors, config = self.core.errors(slots), self.core.config.termination
        outcomes = find_outcome(
            is_success=is_at_goal(errors.position_m, errors.rotation_rad, config),
            dropped=self.core.is_dropped(slots),
            is_unstable=is_unstable,
            steps=self.core.steps[slots],
            config=config,
        )
        return StepResult(reward=self.core.reward(slots), errors=errors, outcomes=outcomes)

    def observe(self, slots: Slots | None = None) -> dict[str, np.ndarray]:
        """All entries of the observation of slots (default: all), one row each."""
        seen = cast(dict[str, np.ndarray], self.core.observe(slots))
        rows = np.arange(self.core.size) if slots is None else slots
        if self.core.config.has_object_states:
            seen["object_states"] = self._object_states(rows)
        if self._rig is not None:
            batch = self.core.batch
            qpos = np.concatenate([batch.arm_qpos[rows], joint_state(batch.object_poses[rows])[:, 7:]], axis=1)
            seen |= self._rig.observe([batch.scenes[slot] for slot in rows], qpos)
        return seen

    def close(self) -> None:
        """Free the graphics context of the cameras."""
        if self._rig is not None:
            self._rig.close()

    def _load(self, slots: Slots, starts: EpisodeStarts) -> None:
        self.core.load(
            slots,
            [task.model for task in starts.tasks],
            [task.pair for task in starts.tasks],
            physics=starts.physics,
            noise_rngs=starts.noise_rngs,
        )

    def _object_states(self, slots: Slots) -> Float32[np.ndarray, "slot object 15"]:
        batch = self.core.batch
        physics = [
            np.stack([batch.scenes[slot].object_masses_kg(), batch.scenes[slot].object_frictions()], axis=1)
            for slot in slots
        ]
        states = [batch.object_poses[slots], batch.object_velocities[slots], np.stack(physics)]
        return np.concatenate(states, axis=2).astype(np.float32)

    def _report(self, slot: int) -> None:
        task, state = self._streams.tasks[slot], self.core.batch.states[slot]
        key = task.scene.scene_id, task.pair_index
        report_unstable(self._streams.source.sha256, key, int(self.core.steps[slot]) - 1, state, self._unstable_dir)
