"""Gymnasium's vector environment: many scenes side by side, stepped in one batch on all cores."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from jaxtyping import Bool, Float32

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.batched_env import DEFAULT_SPLIT, BatchedEnv, open_tasks
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.episode_streams import StreamPlaces
from clutter6d.envs.episodes import EpisodeSlots, StepResult
from clutter6d.envs.frames import FrameRenderer
from clutter6d.envs.info import Info, describe_start, describe_step, overlay, restrict, spread
from clutter6d.envs.slots import Motion, Slots
from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.render.picture import Image
from clutter6d.sim.scene_model import joint_state

RENDER_MODES: Final = ("rgb_array",)

Observations = dict[str, np.ndarray]
Step = tuple[Observations, np.ndarray, np.ndarray, np.ndarray, Info]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Snapshot:
    """A vector environment between two steps: all that decides what it does next.

    Attributes:
        places: The streams of episodes.
        motion: How far the episodes are.
        is_over: Which of them are over and wait for a reset.
        training_step: Control steps made, which the action scale's curriculum follows.
        action_scale_rad: The action scale.
    """

    places: StreamPlaces
    motion: Motion
    is_over: Bool[np.ndarray, "env"]
    training_step: int
    action_scale_rad: float


class ClutterVectorEnv(BatchedEnv[np.ndarray]):
    """Environments that step together, each with a scene and a goal pair of its own.

    At each reset an environment draws a scene and one of its goal pairs, evenly, from a stream that belongs to its
    seed; what happens in it does not depend on the other environments, to the bit. The page "Environments" of the
    documentation lists observation, action, reward and ``info``.

    Args:
        num_envs: Environments.
        split: A frozen split, a folder made by ``clutter6d generate``, or scenes.
        track: Track that the scenes must be of; ``None`` for any.
        config: Actions, observations, reward and termination.
        autoreset_mode: What follows an episode's end: ``NextStep`` (Gymnasium's default), ``SameStep``, ``Disabled``.
        max_episode_steps: Control steps of an episode, instead of the configuration's 300.
        threads: Threads of simulation and observation; 0 for all cores.
        render_mode: ``"rgb_array"`` or ``None``.
        kept_models: Compiled scenes kept in memory, 1.4 MB (sparse) to 3.2 MB (dense) each.
        unstable_dir: Where the state before an invalid simulation step is kept for a replay; ``None``: not kept.

    Attributes:
        training_step: Control steps made since the environment was made, which the action scale's curriculum follows;
            may be set, to go on with a training.

    Raises:
        InvalidValueError: An argument out of range, or scenes of another track.
        UnknownNameError: There is no such split, autoreset mode or render mode.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 10}  # noqa: RUF012 - Gymnasium's way

    def __init__(
        self,
        num_envs: int = 1,
        *,
        split: str | Path | SceneCollection = DEFAULT_SPLIT,
        track: str | None = None,
        config: EnvConfig | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        threads: int = 0,
        render_mode: str | None = None,
        kept_models: int = 1024,
        unstable_dir: Path | str | None = None,
    ) -> None:
        if render_mode not in (None, *RENDER_MODES):
            raise UnknownNameError("render mode", str(render_mode), RENDER_MODES)
        source = open_tasks(split, track, kept_models)
        super().__init__(num_envs, source, config or EnvConfig(), autoreset_mode, max_episode_steps)
        self.render_mode = render_mode
        where = None if unstable_dir is None else Path(unstable_dir)
        self._episodes = EpisodeSlots(self.streams, self.config, threads=threads, unstable_dir=where)
        self._frames = FrameRenderer() if render_mode else None
        self._is_over = np.zeros(num_envs, dtype=bool)

    def step(self, actions: Float32[np.ndarray, "env action"]) -> Step:
        """Advance every environment by one control step of 0.1 s.

        Raises:
            InvalidValueError: Actions of another shape, or that are not finite; or, without autoreset, an episode
                that is over.
            ResetNeeded: Nothing has been reset yet.
        """
        actions = self._checked(actions)
        mode, was_over = self.metadata["autoreset_mode"], self._is_over
        if mode is AutoresetMode.DISABLED and was_over.any():
            over = np.flatnonzero(was_over).tolist()
            raise InvalidValueError(f"the episodes of environments {over} are over; reset them (reset_mask)")
        resetting, acting = np.flatnonzero(was_over), np.flatnonzero(~was_over)
        if len(resetting):
            self._begin(resetting)
        self._count_step()
        result = self._episodes.step(acting, actions[acting])
        rewards, terminated, truncated = self._outcome_arrays(acting, result)
        info = self._describe(np.arange(self.num_envs)) | spread(describe_step(result), acting, self.num_envs)
        observations = self._observe()
        self._is_over = terminated | truncated
        if mode is AutoresetMode.SAME_STEP and self._is_over.any():
            observations, info = self._reset_now(observations, info)
        return observations, rewards, terminated, truncated, info

    def snapshot(self) -> Snapshot:
        """What it takes to go on from here, with equal arguments, to the bit.

        Raises:
            ResetNeeded: Nothing has been reset yet.
        """
        if not self._has_begun:
            raise ResetNeeded("call reset() before snapshot()")
        return Snapshot(
            places=self.streams.places,
            motion=self._episodes.core.motion,
            is_over=self._is_over.copy(),
            training_step=self.training_step,
            action_scale_rad=self.action_scale_rad,
        )

    def restore(self, snapshot: Snapshot) -> Observations:
        """Go on from a snapshot of an environment that was made with equal arguments.

        Returns:
            The observation at that moment.

        Raises:
            InvalidValueError: The snapshot is of another number of environments or of other scenes.
            UnknownNameError: A scene is no longer there.
        """
        self._episodes.return_to(snapshot.places, snapshot.motion)
        self._is_over = snapshot.is_over.copy()
        self.training_step, self.action_scale_rad = snapshot.training_step, snapshot.action_scale_rad
        self._is_seeded = self._has_begun = True
        return self._observe()

    def render(self) -> tuple[Image, ...] | None:
        """A picture of each environment, ``(480, 640, 3)`` uint8; ``None`` without a render mode."""
        if self._frames is None:
            return None
        arm, poses = self._episodes.core.batch.arm_qpos, self._episodes.core.batch.object_poses
        return tuple(
            self._frames.draw(task, joint_state(poses[slot], arm[slot])) for slot, task in enumerate(self.streams.tasks)
        )

    def close_extras(self, **_: Any) -> None:
        """Free the graphics contexts."""
        self._episodes.close()
        if self._frames is not None:
            self._frames.close()

    def _use_config(self) -> None:
        self._episodes.core.config = self.config

    def _observe(self) -> Observations:
        return self._episodes.observe()

    def _begin(self, slots: Slots, chosen: Sequence[tuple[str, int]] | None = None) -> None:
        self._episodes.begin(slots, chosen)
        self._is_over[slots] = False

    def _checked(self, actions: object) -> Float32[np.ndarray, "env action"]:
        if not self._has_begun:
            raise ResetNeeded("call reset() before step()")
        given, wanted = np.asarray(actions, dtype=np.float32), self.action_space.shape
        if given.shape != wanted:
            raise InvalidValueError(f"actions have shape {given.shape}, expected {wanted}")
        bad = np.flatnonzero(~np.isfinite(given).all(axis=1))
        if len(bad):
            raise InvalidValueError(f"the actions of environments {bad.tolist()} are not finite")
        return given

    def _describe(self, slots: Slots) -> Info:
        tasks, errors = self.streams.tasks, self._episodes.core.errors(slots)
        return spread(describe_start([tasks[slot] for slot in slots], errors), slots, self.num_envs)

    def _outcome_arrays(self, acting: Slots, result: StepResult) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rewards, terminations and truncations; zero and false for environments that were reset instead."""
        rewards = np.zeros(self.num_envs)
        terminated, truncated = np.zeros(self.num_envs, dtype=bool), np.zeros(self.num_envs, dtype=bool)
        rewards[acting] = result.reward.total
        terminated[acting] = [outcome not in (None, "timeout") for outcome in result.outcomes]
        truncated[acting] = [outcome == "timeout" for outcome in result.outcomes]
        return rewards, terminated, truncated

    def _reset_now(self, last: Observations, info: Info) -> tuple[Observations, Info]:
        """Begin anew where an episode is over; what was seen and known at its end moves to ``final_*``."""
        over, size = np.flatnonzero(self._is_over), self.num_envs
        final = np.full(size, None, dtype=object)
        for slot in over:
            final[slot] = {name: value[slot].copy() for name, value in last.items()}
        ended = {"final_obs": final, "_final_obs": self._is_over.copy()}
        ended |= {"final_info": restrict(info, self._is_over), "_final_info": self._is_over.copy()}
        kept = restrict(info, ~self._is_over)
        self._begin(over)
        for name, value in self._episodes.observe(over).items():
            last[name][over] = value
        return last, overlay(kept, self._describe(over)) | ended
