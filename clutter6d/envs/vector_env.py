"""Gymnasium's vector environment: many scenes side by side, stepped in one batch on all cores."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from jaxtyping import Float32

from clutter6d.dataset.scenes import SceneCollection, open_scenes
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.episodes import EpisodeSlots, StepResult
from clutter6d.envs.frames import FrameRenderer
from clutter6d.envs.info import Info, describe_start, describe_step, overlay, restrict, spread
from clutter6d.envs.reset_options import read_reset_options
from clutter6d.envs.slots import Slots
from clutter6d.envs.spaces import make_action_space, make_observation_space
from clutter6d.envs.tasks import TaskSource
from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.render.picture import Image
from clutter6d.sim.scene_model import joint_state

DEFAULT_SPLIT: Final = "sparse-train"
RENDER_MODES: Final = ("rgb_array",)

Observations = dict[str, np.ndarray]
Step = tuple[Observations, np.ndarray, np.ndarray, np.ndarray, Info]


class ClutterVectorEnv(VectorEnv[Observations, np.ndarray, np.ndarray]):
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
        config = config or EnvConfig()
        if max_episode_steps is not None:
            config = replace(config, termination=replace(config.termination, max_steps=max_episode_steps))
        if num_envs < 1:
            raise InvalidValueError(f"num_envs is {num_envs}; at least 1 is needed")
        if render_mode not in (None, *RENDER_MODES):
            raise UnknownNameError("render mode", str(render_mode), RENDER_MODES)
        self.num_envs, self.render_mode = num_envs, render_mode
        self.metadata = {**self.metadata, "autoreset_mode": read_autoreset_mode(autoreset_mode)}
        self._episodes = EpisodeSlots(
            open_tasks(split, track, kept_models),
            num_envs,
            config,
            threads=threads,
            unstable_dir=None if unstable_dir is None else Path(unstable_dir),
        )
        objects = self._episodes.tasks[0].model.object_count
        self.single_observation_space = make_observation_space(objects, config)
        self.single_action_space = make_action_space(config.action)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._frames = FrameRenderer() if render_mode else None
        self._is_over = np.zeros(num_envs, dtype=bool)
        self._is_seeded = self._has_begun = False
        self.training_step = 0

    @property
    def config(self) -> EnvConfig:
        """Actions, observations, reward and termination."""
        return self._episodes.core.config

    @property
    def action_scale_rad(self) -> float:
        """Largest residual of a joint in one control step [rad]; may be set, the action space stays the same."""
        return self.config.action.action_scale_rad

    @action_scale_rad.setter
    def action_scale_rad(self, value: float) -> None:
        core = self._episodes.core
        core.config = replace(core.config, action=replace(core.config.action, action_scale_rad=value))

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, Info]:
        """Start episodes in all environments, or in those of ``options["reset_mask"]``.

        Args:
            seed: Of the streams that scenes and goal pairs are drawn from: one for each environment, or the first
                one's, the others following by one each; ``None`` goes on with the streams there are.
            options: See :func:`clutter6d.envs.reset_options.read_reset_options`.

        Raises:
            UnknownNameError: An unknown option or scene.
            InvalidValueError: A value that is not allowed.
        """
        chosen = read_reset_options(options, self.num_envs)
        self._seed(seed)
        if not self._has_begun and len(chosen.slots) < self.num_envs:
            raise InvalidValueError("the first reset starts all environments; leave reset_mask out")
        self._begin(chosen.slots, chosen.chosen)
        self._has_begun = True
        return self._episodes.observe(), self._describe(chosen.slots)

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
        if self.config.action.curriculum is not None:
            self.action_scale_rad = self.config.action.curriculum.at(self.training_step)
        self.training_step += 1
        result = self._episodes.step(acting, actions[acting])
        rewards, terminated, truncated = self._outcome_arrays(acting, result)
        info = self._describe(np.arange(self.num_envs)) | spread(describe_step(result), acting, self.num_envs)
        observations = self._episodes.observe()
        self._is_over = terminated | truncated
        if mode is AutoresetMode.SAME_STEP and self._is_over.any():
            observations, info = self._reset_now(observations, info)
        return observations, rewards, terminated, truncated, info

    def render(self) -> tuple[Image, ...] | None:
        """A picture of each environment, ``(480, 640, 3)`` uint8; ``None`` without a render mode."""
        if self._frames is None:
            return None
        arm, poses = self._episodes.core.batch.arm_qpos, self._episodes.core.batch.object_poses
        return tuple(
            self._frames.draw(task, joint_state(poses[slot], arm[slot]))
            for slot, task in enumerate(self._episodes.tasks)
        )

    def close_extras(self, **_: Any) -> None:
        """Free the graphics contexts."""
        self._episodes.close()
        if self._frames is not None:
            self._frames.close()

    def _seed(self, seed: int | Sequence[int | None] | None) -> None:
        if seed is None and not self._is_seeded:
            seed = cast(int, self.np_random_seed)
        if isinstance(seed, int):
            super().reset(seed=seed)
            seed = [seed + slot for slot in range(self.num_envs)]
        self._episodes.seed([None] * self.num_envs if seed is None else list(seed))
        self._is_seeded = True

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
        tasks, errors = self._episodes.tasks, self._episodes.core.errors(slots)
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


def read_autoreset_mode(mode: AutoresetMode | str) -> AutoresetMode:
    """Gymnasium's mode of a name.

    Raises:
        UnknownNameError: There is no such mode.
    """
    try:
        return AutoresetMode(mode)
    except ValueError:
        raise UnknownNameError("autoreset mode", str(mode), [known.value for known in AutoresetMode]) from None


def open_tasks(split: str | Path | SceneCollection, track: str | None, kept_models: int) -> TaskSource:
    """The tasks of a split, a folder of scenes, or scenes.

    Raises:
        InvalidValueError: They are of another track.
    """
    source = TaskSource(open_scenes(split) if isinstance(split, (str, Path)) else split, kept_models=kept_models)
    if track is not None and source.tracks != {track}:
        found = ", ".join(sorted(source.tracks))
        raise InvalidValueError(f"these scenes are of the track {found}, not {track}; give others by split=")
    return source
