"""Gymnasium's environment: one robot, one scene at a time."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from jaxtyping import Float32

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.batched_env import DEFAULT_SPLIT
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.info import Info, of_one
from clutter6d.envs.vector_env import ClutterVectorEnv, Observations
from clutter6d.errors import InvalidValueError
from clutter6d.render.picture import Image


class ClutterEnv(gymnasium.Env[Observations, np.ndarray]):
    """One environment: a :class:`~clutter6d.envs.vector_env.ClutterVectorEnv` of one, without its leading axis.

    Arguments and errors are those of the vector environment.
    """

    metadata = ClutterVectorEnv.metadata

    def __init__(
        self,
        *,
        split: str | Path | SceneCollection = DEFAULT_SPLIT,
        track: str | None = None,
        config: EnvConfig | None = None,
        render_mode: str | None = None,
        kept_models: int = 1024,
        unstable_dir: Path | str | None = None,
    ) -> None:
        self._only = ClutterVectorEnv(
            1,
            split=split,
            track=track,
            config=config,
            autoreset_mode=AutoresetMode.DISABLED,
            threads=1,
            render_mode=render_mode,
            kept_models=kept_models,
            unstable_dir=unstable_dir,
        )
        self.render_mode = render_mode
        self.observation_space = self._only.single_observation_space
        self.action_space = self._only.single_action_space

    @property
    def config(self) -> EnvConfig:
        """Actions, observations, reward and termination."""
        return self._only.config

    @property
    def action_scale_rad(self) -> float:
        """Largest residual of a joint in one control step [rad]; may be set, the action space stays the same."""
        return self._only.action_scale_rad

    @action_scale_rad.setter
    def action_scale_rad(self, value: float) -> None:
        self._only.action_scale_rad = value

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observations, Info]:
        """Start an episode: the next of the stream that belongs to the seed, or ``options``' ``scene_id`` and ``pair``.

        Raises:
            UnknownNameError: An unknown option or scene.
            InvalidValueError: A value that is not allowed.
        """
        is_first = self._np_random is None
        super().reset(seed=seed)
        stream = self.np_random_seed if is_first or seed is not None else None
        observations, info = self._only.reset(seed=stream, options=options)
        return _first(observations), of_one(info)

    def step(self, action: Float32[np.ndarray, "action"]) -> tuple[Observations, float, bool, bool, Info]:
        """Advance by one control step of 0.1 s.

        Raises:
            InvalidValueError: An action of another shape or not finite, or the episode is over.
        """
        if np.shape(action) != self.action_space.shape:
            raise InvalidValueError(f"the action has shape {np.shape(action)}, expected {self.action_space.shape}")
        observations, rewards, terminated, truncated, info = self._only.step(np.asarray(action)[None])
        return _first(observations), float(rewards[0]), bool(terminated[0]), bool(truncated[0]), of_one(info)

    def render(self) -> Image | None:  # pyright: ignore[reportIncompatibleMethodOverride] - one of Gymnasium's kinds
        """A picture, ``(480, 640, 3)`` uint8; ``None`` without a render mode."""
        frames = self._only.render()
        return None if frames is None else frames[0]

    def close(self) -> None:
        """Free the graphics context."""
        self._only.close()


def _first(observations: Observations) -> Observations:
    return {name: value[0] for name, value in observations.items()}
