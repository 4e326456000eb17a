"""The environments of a distillation: seen with errors by the student, and as they are by the teacher."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import torch
from jaxtyping import Float32, Int, Int32
from torch import Tensor

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.observation import Observation
from clutter6d.envs.observation_noise import ObservationNoise
from clutter6d.envs.vector_env import ClutterVectorEnv, Snapshot
from clutter6d.eval.policy import Episode, Policy, PolicyInput, begin_episodes
from clutter6d.seeding import generator
from dapl_baselines.distillation.settings import DistillationSettings
from dapl_baselines.policy.episode_tally import EpisodeTally
from dapl_baselines.policy.observation import cloud, state_vector


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StudentView:
    """What the student sees of all environments.

    Attributes:
        state: ``s_env``.
        cloud: The points, with errors.
        ages: Control steps that each episode has made.
    """

    state: Float32[Tensor, "env state"]
    cloud: Float32[Tensor, "env 1280 7"]
    ages: Int32[Tensor, "env"]


class StudentEnv:
    """Environments that reset themselves at once.

    The environment itself has no errors. The student's are those of an environment with that noise and the same seeds,
    to the bit: they hang on the episode and the step alone, and so need not be kept when a training is stopped.

    Args:
        scenes: What is trained on.
        settings: Of the distillation.
        teacher: Told of every episode that begins.
        threads: Threads of the simulation; 0 for all cores.

    Attributes:
        tally: What became of the episodes.
    """

    def __init__(
        self, scenes: SceneCollection, settings: DistillationSettings, teacher: Policy, *, threads: int = 0
    ) -> None:
        self.tally = EpisodeTally(settings.envs, torch.device("cpu"))
        self._envs = ClutterVectorEnv(
            settings.envs, split=scenes, config=settings.env(), autoreset_mode="SameStep", threads=threads
        )
        self._parts, self._teacher = settings.network.state_parts, teacher
        self._all = np.arange(settings.envs)
        objects = self._envs.streams.tasks[0].model.object_count
        self._noise = ObservationNoise(settings.noise(), settings.envs, objects)
        self._observation: Mapping[str, np.ndarray] = {}
        self._episodes: dict[int, Episode] = {}

    def reset(self, seed: int) -> None:
        """Begin episodes in all environments."""
        self._observation = self._envs.reset(seed=seed)[0]
        self._begin(self._all)

    def snapshot(self) -> Snapshot:
        """Where the environments are."""
        return self._envs.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from where environments were; the teacher begins anew in the midst of the episodes."""
        self._observation = self._envs.restore(snapshot)
        self._begin(self._all)

    def student_view(self) -> StudentView:
        """What the student sees now."""
        steps = self._envs.snapshot().motion.steps
        seen = self._noise.disturb_points(self._all, steps, self._clean())
        return StudentView(
            state=state_vector(seen, self._parts), cloud=cloud(seen), ages=torch.from_numpy(steps.astype(np.int32))
        )

    def teacher_input(self) -> PolicyInput:
        """What the teacher sees now."""
        motion = self._envs.snapshot().motion
        return PolicyInput(
            slots=self._all,
            episodes=tuple(self._episodes[slot] for slot in self._all.tolist()),
            steps=motion.steps,
            observation=self._clean() if self._teacher.needs_observation else None,
            states=motion.states if self._teacher.is_privileged else None,
        )

    def step(self, residuals: Float32[Tensor, "env 7"]) -> None:
        """Advance all environments by one control step.

        Args:
            residuals: Of the joints [rad].
        """
        self._observation, rewards, ended, timed_out, info = self._envs.step(residuals.numpy())
        is_over = ended | timed_out
        is_success = info["final_info"]["is_success"] if is_over.any() else np.zeros_like(is_over)
        self.tally.add(*(torch.from_numpy(np.asarray(value)) for value in (rewards, is_over, is_success)))
        if is_over.any():
            self._begin(np.flatnonzero(is_over))

    def close(self) -> None:
        """Free what the environments hold."""
        self._envs.close()

    def _begin(self, slots: Int[np.ndarray, "slot"]) -> None:
        """Episodes have begun in slots: new errors, and the teacher forgets."""
        places, tasks = self._envs.streams.places, self._envs.streams.tasks
        for slot in slots.tolist():
            task, seed = tasks[slot], places.seeds[slot]
            self._episodes[slot] = Episode(
                scene=task.scene, pair_index=task.pair_index, scene_model=task.model, seed=seed
            )
            self._noise.start(
                slot,
                generator(seed, "noise", places.numbers[slot] - 1),
                masses_kg=task.model.object_masses_kg(),
                initial=task.pair.object_poses[0],
                goal=task.pair.goal.as_row(),
            )
        begin_episodes(self._teacher, slots, [self._episodes[slot] for slot in slots])

    def _clean(self) -> Observation[np.ndarray]:
        return cast(Any, self._observation)
