"""What the vector environments on CPU and GPU share: spaces, seeds, resets, the action scale."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, Generic, cast

from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from clutter6d.arrays import Array
from clutter6d.dataset.scenes import SceneCollection, open_scenes
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.episode_streams import EpisodeStreams
from clutter6d.envs.reset_options import read_reset_options
from clutter6d.envs.slots import Slots
from clutter6d.envs.spaces import make_action_space, make_observation_space
from clutter6d.envs.tasks import TaskSource
from clutter6d.errors import InvalidValueError, UnknownNameError

DEFAULT_SPLIT: Final = "sparse-train"


class BatchedEnv(VectorEnv[dict[str, Array], Array, Array], ABC, Generic[Array]):
    """Environments that step together, each with a scene and a goal pair of its own.

    Args:
        num_envs: Environments.
        source: Where scenes and goal pairs come from.
        config: Actions, observation, physics, reward and termination.
        autoreset_mode: What follows an episode's end.
        max_episode_steps: Control steps of an episode, instead of the configuration's.

    Attributes:
        config: Actions, observation, physics, reward and termination, as they are now.
        streams: The episodes of each environment.
        training_step: Control steps made since the environment was made, which the action scale's curriculum follows;
            may be set, to go on with a training.

    Raises:
        InvalidValueError: There is no environment, or an episode has no step.
        UnknownNameError: There is no such autoreset mode.
    """

    def __init__(
        self,
        num_envs: int,
        source: TaskSource,
        config: EnvConfig,
        autoreset_mode: AutoresetMode | str,
        max_episode_steps: int | None,
    ) -> None:
        if num_envs < 1:
            raise InvalidValueError(f"num_envs is {num_envs}; at least 1 is needed")
        if max_episode_steps is not None:
            config = replace(config, termination=replace(config.termination, max_steps=max_episode_steps))
        self.num_envs, self.config = num_envs, config
        self.metadata = {**self.metadata, "autoreset_mode": _read_mode(autoreset_mode)}
        self.streams = EpisodeStreams(source, num_envs, config)
        objects = self.streams.tasks[0].model.object_count
        self.single_observation_space = make_observation_space(objects, config)
        self.single_action_space = make_action_space(config.action)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.training_step = 0
        self._is_seeded = self._has_begun = False

    @property
    def action_scale_rad(self) -> float:
        """Largest residual of a joint in one control step [rad]; may be set, the action space stays the same."""
        return self.config.action.action_scale_rad

    @action_scale_rad.setter
    def action_scale_rad(self, value: float) -> None:
        self.config = replace(self.config, action=replace(self.config.action, action_scale_rad=value))
        self._use_config()

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Array], dict[str, Any]]:
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
        return self._observe(), self._describe(chosen.slots)

    @abstractmethod
    def _use_config(self) -> None:
        """Let the simulation know of a changed configuration."""

    @abstractmethod
    def _begin(self, slots: Slots, chosen: Sequence[tuple[str, int]] | None = None) -> None:
        """Start the next episode of environments: the stream's, or chosen ones."""

    @abstractmethod
    def _observe(self) -> dict[str, Array]:
        """The observation of all environments."""

    @abstractmethod
    def _describe(self, slots: Slots) -> dict[str, Any]:
        """What ``info`` says of some environments after a reset."""

    def _seed(self, seed: int | Sequence[int | None] | None) -> None:
        if seed is None and not self._is_seeded:
            seed = cast(int, self.np_random_seed)
        if isinstance(seed, int):
            super().reset(seed=seed)
            seed = [seed + slot for slot in range(self.num_envs)]
        self.streams.seed([None] * self.num_envs if seed is None else list(seed))
        self._is_seeded = True

    def _count_step(self) -> None:
        """A control step is about to be made: the curriculum, if there is one, sets the action scale."""
        if self.config.action.curriculum is not None:
            self.action_scale_rad = self.config.action.curriculum.at(self.training_step)
        self.training_step += 1


def open_tasks(split: str | Path | SceneCollection, track: str | None, kept_models: int) -> TaskSource:
    """The tasks of a split, a folder of scenes, or scenes.

    Raises:
        InvalidValueError: They are of another track.
        UnknownNameError: There is no such split.
    """
    source = TaskSource(open_scenes(split) if isinstance(split, (str, Path)) else split, kept_models=kept_models)
    if track is not None and source.tracks != {track}:
        found = ", ".join(sorted(source.tracks))
        raise InvalidValueError(f"these scenes are of the track {found}, not {track}; give others by split=")
    return source


def _read_mode(mode: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError:
        raise UnknownNameError("autoreset mode", str(mode), [known.value for known in AutoresetMode]) from None
