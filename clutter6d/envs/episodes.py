"""Episodes in slots: which task each slot runs, what it sees, and how it ends."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np
from jaxtyping import Float32

from clutter6d.envs.cameras import CameraRig
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.randomisation import PhysicsDraw, draw_physics
from clutter6d.envs.reward import RewardTerms
from clutter6d.envs.slots import ClutterSlots, Slots
from clutter6d.envs.tasks import Task, TaskSource
from clutter6d.envs.termination import GoalErrors, Outcome, find_outcome, is_at_goal
from clutter6d.envs.unstable_state import report_unstable
from clutter6d.seeding import generator
from clutter6d.sim.model_variation import named_scales
from clutter6d.sim.scene_model import joint_state


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
        source: Where the tasks come from.
        size: Slots.
        config: Actions, observation, physics, reward and termination.
        threads: Threads of simulation and observation; 0 for all cores.
        unstable_dir: Where the state before an invalid step is kept.

    Attributes:
        core: The simulation.
    """

    def __init__(
        self, source: TaskSource, size: int, config: EnvConfig, *, threads: int = 0, unstable_dir: Path | None = None
    ) -> None:
        first = source.first()
        self.core = ClutterSlots([first.model] * size, config, threads=threads)
        self._source, self._unstable_dir = source, unstable_dir
        self._rig = CameraRig(config.cameras, kept_scenes=max(size, 64)) if config.cameras else None
        self._tasks = [first] * size
        self._seeds, self._numbers = [0] * size, [0] * size

    @property
    def tasks(self) -> tuple[Task, ...]:
        """The task of each slot."""
        return tuple(self._tasks)

    def seed(self, slot: int, seed: int) -> None:
        """Start a slot's stream of episodes anew."""
        self._seeds[slot], self._numbers[slot] = seed, 0

    def begin(self, slots: Slots, chosen: Sequence[tuple[str, int]] | None = None) -> None:
        """Start the next episode of each slot's stream.

        Args:
            slots: Which.
            chosen: Scene and pair of each; ``None``: drawn. What else an episode draws comes from the stream.

        Raises:
            UnknownNameError: There is no scene of that id, or no object of a name in ``mass_scale``.
            InvalidValueError: The scene has no such pair.
        """
        names = chosen or [None] * len(slots)
        tasks = [self._next_task(int(slot), name) for slot, name in zip(slots, names, strict=True)]
        for slot, task in zip(slots, tasks, strict=True):
            self._tasks[slot] = task
        streams = [(self._seeds[slot], self._numbers[slot]) for slot in slots]
        self.core.load(
            slots,
            [task.model for task in tasks],
            [task.pair for task in tasks],
            physics=self._draw_physics(tasks, streams),
            noise_rngs=[generator(seed, "noise", number) for seed, number in streams],
        )
        for slot in slots:
            self._numbers[slot] += 1

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

    def _next_task(self, slot: int, chosen: tuple[str, int] | None) -> Task:
        if chosen is not None:
            return self._source.choose(*chosen)
        return self._source.draw(self._seeds[slot], self._numbers[slot])

    def _draw_physics(self, tasks: Sequence[Task], streams: Sequence[tuple[int, int]]) -> list[PhysicsDraw] | None:
        ranges, scales = self.core.config.randomisation, self.core.config.mass_scale
        if not (ranges.varies_model or ranges.delays_commands or scales):
            return None
        draws: list[PhysicsDraw] = []
        for task, (seed, number) in zip(tasks, streams, strict=True):
            draw = draw_physics(ranges, generator(seed, "physics", number), task.model.object_count)
            mass_scale = draw.mass_scale * named_scales(task.model.names, scales)
            draws.append(replace(draw, mass_scale=mass_scale))
        return draws

    def _object_states(self, slots: Slots) -> Float32[np.ndarray, "slot object 15"]:
        batch = self.core.batch
        physics = [
            np.stack([batch.scenes[slot].object_masses_kg(), batch.scenes[slot].object_frictions()], axis=1)
            for slot in slots
        ]
        states = [batch.object_poses[slots], batch.object_velocities[slots], np.stack(physics)]
        return np.concatenate(states, axis=2).astype(np.float32)

    def _report(self, slot: int) -> None:
        task, state = self._tasks[slot], self.core.batch.states[slot]
        key = task.scene.scene_id, task.pair_index
        report_unstable(self._source.sha256, key, int(self.core.steps[slot]) - 1, state, self._unstable_dir)
