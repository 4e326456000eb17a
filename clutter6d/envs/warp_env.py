"""Gymnasium's vector environment on a GPU: :mod:`clutter6d.envs.vector_env` with tensors that stay on the device."""

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from jaxtyping import Bool, Float32, Int

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.batched_env import DEFAULT_SPLIT, BatchedEnv, open_tasks
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.slots import Slots
from clutter6d.envs.termination import OUTCOMES
from clutter6d.envs.warp_info import DeviceInfo, TaskNames, describe_start, describe_step, end_of_episode
from clutter6d.envs.warp_slots import WarpSlots
from clutter6d.errors import InvalidValueError
from clutter6d.sim.warp_buffers import BufferSizes
from clutter6d.sim.warp_runtime import torch

Observations = dict[str, torch.Tensor]
Step = tuple[Observations, torch.Tensor, torch.Tensor, torch.Tensor, DeviceInfo]

_TIMEOUT: Final = OUTCOMES.index("timeout")
_log = logging.getLogger(__name__)


class WarpVectorEnv(BatchedEnv[torch.Tensor]):
    """Environments that step together on a GPU, each with a scene and a goal pair of its own.

    The same observations, actions, rewards and episodes as :class:`~clutter6d.envs.vector_env.ClutterVectorEnv`, as
    tensors on the device; the same seed draws the same scenes and goal pairs. The simulation is MuJoCo Warp's: close to
    MuJoCo's and not deterministic, so policies are trained here and scored on the CPU (``docs/gpu.md``).

    Args:
        num_envs: Environments.
        device: ``"cuda"``, ``"cuda:1"`` ..., or ``"cpu"`` (for tests: it is slow).
        split: A frozen split, a folder made by ``clutter6d generate``, or scenes.
        track: Track that the scenes must be of; ``None`` for any.
        config: Actions, physics, reward and termination; neither noise nor cameras.
        autoreset_mode: What follows an episode's end: ``NextStep`` (Gymnasium's default), ``SameStep``, ``Disabled``.
        max_episode_steps: Control steps of an episode, instead of the configuration's 300.
        kept_models: Compiled scenes kept in the host's memory, 1.4 MB (sparse) to 3.2 MB (dense) each.
        sizes: Room for contacts and constraints.

    Attributes:
        slots: Simulation, observation and reward.
        training_step: Control steps made since the environment was made, which the action scale's curriculum follows.

    Raises:
        InvalidValueError: An argument out of range, no such device, or scenes of another track.
        UnknownNameError: There is no such split or autoreset mode.
    """

    metadata: dict[str, Any] = {"render_modes": [], "render_fps": 10}  # noqa: RUF012 - Gymnasium's way

    def __init__(
        self,
        num_envs: int = 1,
        *,
        device: str = "cuda",
        split: str | Path | SceneCollection = DEFAULT_SPLIT,
        track: str | None = None,
        config: EnvConfig | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        kept_models: int = 1024,
        sizes: BufferSizes | None = None,
    ) -> None:
        source = open_tasks(split, track, kept_models)
        super().__init__(num_envs, source, _checked(config or EnvConfig()), autoreset_mode, max_episode_steps)
        models = [task.model for task in self.streams.tasks]
        self.slots = WarpSlots(models, self.config, device=device, sizes=sizes)
        self._is_over = torch.zeros(num_envs, dtype=torch.bool, device=self.device)
        self._names = TaskNames.of(self.streams.tasks)

    @property
    def device(self) -> torch.device:
        """Where all tensors are."""
        return self.slots.batch.device

    def step(self, actions: Float32[torch.Tensor, "env action"] | Float32[np.ndarray, "env action"]) -> Step:
        """Advance every environment by one control step of 0.1 s.

        An environment whose episode was over begins the next one instead; its action is not used.

        Raises:
            InvalidValueError: Actions of another shape, or that are not finite; or, without autoreset, an episode
                that is over.
            ResetNeeded: Nothing has been reset yet.
        """
        given, was_over = self._checked_actions(actions)
        acting = ~self._is_over
        self._count_step()
        is_unstable = self.slots.step(given) & acting
        self._report(is_unstable)
        if was_over.any():
            self._begin(np.flatnonzero(was_over))
        errors, reward = self.slots.errors(), self.slots.reward()
        outcomes = torch.where(acting, self.slots.outcomes(errors, is_unstable), -1)
        truncated = outcomes == _TIMEOUT
        terminated = (outcomes >= 0) & ~truncated
        self._is_over = terminated | truncated
        info = describe_start(self._names, errors, torch.ones_like(acting))
        info |= describe_step(reward, outcomes, acting)
        observations = self._observe()
        if self.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP:
            observations, info = self._reset_now(observations, info)
        rewards = torch.where(acting, reward.total, 0.0)
        return observations, rewards, terminated, truncated, info

    def _checked_actions(self, actions: Any) -> tuple[Float32[torch.Tensor, "env action"], Bool[np.ndarray, "env"]]:
        """The actions on the device, and which episodes are over; waits for the device once."""
        if not self._has_begun:
            raise ResetNeeded("call reset() before step()")
        given, wanted = torch.as_tensor(actions).to(self.device, torch.float32), self.action_space.shape
        if tuple(given.shape) != wanted:
            raise InvalidValueError(f"actions have shape {tuple(given.shape)}, expected {wanted}")
        is_bad, was_over = torch.stack([~given.isfinite().all(dim=1), self._is_over]).cpu().numpy()
        if is_bad.any():
            raise InvalidValueError(f"the actions of environments {np.flatnonzero(is_bad).tolist()} are not finite")
        if self.metadata["autoreset_mode"] is AutoresetMode.DISABLED and was_over.any():
            over = np.flatnonzero(was_over).tolist()
            raise InvalidValueError(f"the episodes of environments {over} are over; reset them (reset_mask)")
        return given, was_over

    def _report(self, is_unstable: Bool[torch.Tensor, "env"]) -> None:
        for slot in is_unstable.nonzero()[:, 0].tolist():
            task, step = self.streams.tasks[slot], int(self.slots.steps[slot])
            _log.warning("scene %s pair %d: invalid state in step %d", task.scene.scene_id, task.pair_index, step)

    def _begin(self, slots: Slots, chosen: Sequence[tuple[str, int]] | None = None) -> None:
        starts = self.streams.advance(slots, chosen)
        models, pairs = [task.model for task in starts.tasks], [task.pair for task in starts.tasks]
        self.slots.load(slots, models, pairs, physics=starts.physics)
        self._is_over[self._index(slots)] = False
        self._names = TaskNames.of(self.streams.tasks)

    def _reset_now(self, last: Observations, info: DeviceInfo) -> tuple[Observations, DeviceInfo]:
        """Begin anew where an episode is over; what was seen and known at its end moves to ``final_*``."""
        ended, over = self._is_over.clone(), np.flatnonzero(self._is_over.cpu().numpy())
        if not len(over):
            return last, info
        self._begin(over)
        started = describe_start(self._names, self.slots.errors(), torch.ones_like(ended))
        return self._observe(), end_of_episode(last, info, started, ended)

    def _observe(self) -> Observations:
        observations = cast(Observations, self.slots.observe())
        if self.config.has_object_states:
            observations["object_states"] = self.slots.object_states()
        return observations

    def _use_config(self) -> None:
        self.slots.config = self.config

    def _describe(self, slots: Slots) -> DeviceInfo:
        started = torch.zeros_like(self._is_over)
        started[self._index(slots)] = True
        return describe_start(self._names, self.slots.errors(), started)

    def _index(self, slots: Slots) -> Int[torch.Tensor, "slot"]:
        return torch.from_numpy(slots).to(self.device)


def _checked(config: EnvConfig) -> EnvConfig:
    if not config.noise.is_silent:
        raise InvalidValueError(
            "a GPU environment has no observation noise; add it to the tensors, or leave device out"
        )
    if config.cameras:
        raise InvalidValueError("a GPU environment has no cameras; leave device out for one that has")
    return config
