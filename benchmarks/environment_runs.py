"""The vector environment on chosen tasks, and the bare engine on the same models with the same joint targets."""

from collections.abc import Sequence

import numpy as np

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.vector_env import ClutterVectorEnv
from clutter6d.seeding import generator
from clutter6d.sim.batch import SceneBatch

ARM_JOINTS = 7


class EnvironmentRun:
    """The first scenes of a collection side by side, each with another of its goal pairs, under random actions.

    Args:
        scenes: The collection; one with fewer scenes than environments is gone through again.
        envs: Environments.
        steps: Control steps of one run.
        threads: Threads of the simulation and the observation; 0 for all cores.

    Attributes:
        env: The environment.
        actions: Of each step.
        targets: Joint targets of each step, once recorded [rad].
        is_going_on: Environments whose first episode lasted to the end of the recorded run.
    """

    def __init__(self, scenes: SceneCollection, envs: int, steps: int, threads: int) -> None:
        self.env = ClutterVectorEnv(envs, split=scenes, threads=threads, kept_models=max(envs, 1024))
        there = scenes.scenes
        chosen = [there[index % len(there)] for index in range(envs)]
        turns = [index + index // len(there) for index in range(envs)]
        self._options = {
            "scene_id": [scene.scene_id for scene in chosen],
            "pair": [turn % len(scene.goal_pairs) for scene, turn in zip(chosen, turns, strict=True)],
        }
        scale = self.env.action_scale_rad
        shape = (steps, envs, ARM_JOINTS)
        self.actions = generator(0, "actions").uniform(-scale, scale, size=shape).astype(np.float32)
        self.targets = np.empty(shape)
        self.is_going_on = np.ones(envs, dtype=bool)

    @property
    def batch(self) -> SceneBatch:
        """The environment's simulation."""
        return self.env._episodes.core.batch

    def reset(self) -> None:
        """Begin the episodes of the chosen tasks."""
        self.env.reset(options=self._options)

    def run(self) -> None:
        """Step through the environment as any user does."""
        for actions in self.actions:
            self.env.step(actions)

    def step_unobserved(self, actions: np.ndarray) -> None:
        """Command and simulate, without observation, reward or outcome."""
        core = self.env._episodes.core
        core.step(np.arange(core.size), actions)

    def record(self) -> None:
        """Run once to keep the joint targets, and which environments went on to the end without a new episode."""
        self.reset()
        for targets, actions in zip(self.targets, self.actions, strict=True):
            *_, terminated, truncated, _ = self.env.step(actions)
            targets[:] = self.batch.joint_targets
            self.is_going_on &= ~(terminated | truncated)


class BareRun:
    """The same models from the same states with the same joint targets, and nothing else.

    Args:
        recorded: The environment's run, recorded.
        threads: Threads of the simulation; 0 for all cores.
    """

    def __init__(self, recorded: EnvironmentRun, threads: int) -> None:
        recorded.reset()
        self.batch = SceneBatch(recorded.batch.scenes, threads=threads)
        self._start, self._targets = recorded.batch.object_poses.copy(), recorded.targets

    def reset(self) -> None:
        """Objects as stored, at rest."""
        self.batch.reset(np.arange(self.batch.size), self._start)

    def run(self) -> None:
        """Step the engine."""
        for targets in self._targets:
            self.batch.joint_targets[:] = targets
            self.batch.step()


def check_same_end(recorded: EnvironmentRun, bare: BareRun) -> None:
    """Both simulated the same, to the bit.

    Raises:
        SystemExit: They did not.
    """
    rows = recorded.is_going_on
    if not np.array_equal(recorded.batch.states[rows], bare.batch.states[rows]):
        raise SystemExit("the bare simulation did not follow the environment")


def fastest(times: Sequence[float]) -> float:
    """The round that other work disturbed least."""
    return min(times)
