"""Running episodes: many at once in slots, each slot given the next episode when its own ends."""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32, Int

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.slots import ClutterSlots
from clutter6d.envs.tasks import TaskSource
from clutter6d.envs.termination import find_outcome, is_at_goal
from clutter6d.envs.unstable_state import report_unstable
from clutter6d.errors import InvalidValueError
from clutter6d.eval.attempt import Attempt, Look
from clutter6d.eval.episode import EpisodeRecord
from clutter6d.eval.policy import Episode, Policy, PolicyInput, ask_policy, begin_episodes
from clutter6d.physics import CONTROL_STEP_S

HOLD_STEPS = round(1.0 / CONTROL_STEP_S)
"""Control steps for which a success must stand after the robot has stopped: 1 s."""

Slots = Int[np.ndarray, "slot"]
EpisodeKey = tuple[str, int]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Round:
    """One control step of all running episodes, just made; what is in it lives on in the next.

    Attributes:
        env: The slots.
        running: The episodes under way, by slot; those with a row have succeeded and are held.
        finished: Those that ended with this step; their slots still are as they left them.
    """

    env: ClutterSlots
    running: Mapping[int, Attempt]
    finished: tuple[EpisodeRecord, ...]


class EpisodeRunner:
    """Runs a list of episodes; what comes of one depends on its scene, pair, policy and seed alone.

    Args:
        scenes: Scenes and assets.
        policy: What acts.
        config: Actions and termination.
        seed: The evaluation's seed.
        num_envs: Episodes that run at once, at most.
        threads: Threads of the simulation; 0 for all cores.
        unstable_dir: Where the state before an invalid simulation step is kept; ``None``: not kept.

    Raises:
        InvalidValueError: There is not at least one environment.
    """

    def __init__(
        self,
        scenes: SceneCollection,
        policy: Policy,
        *,
        config: EnvConfig | None = None,
        seed: int = 0,
        num_envs: int = 16,
        threads: int = 0,
        unstable_dir: Path | None = None,
    ) -> None:
        if num_envs < 1:
            raise InvalidValueError(f"num-envs is {num_envs}; at least 1 is needed")
        self._policy, self._unstable_dir = policy, unstable_dir
        self._config, self._seed = config or EnvConfig(), seed
        self._num_envs, self._threads = num_envs, threads
        self._tasks = TaskSource(scenes, kept_models=num_envs)

    def run(self, keys: Sequence[EpisodeKey]) -> Iterator[EpisodeRecord]:
        """Run episodes named by scene and pair, and yield each as it finishes.

        Raises:
            InvalidValueError: The policy gave something else than finite float32 residuals, or failed.
        """
        for played in self.rounds(keys):
            yield from played.finished

    def rounds(self, keys: Sequence[EpisodeKey]) -> Iterator[Round]:
        """Run the same episodes and stop to be looked at: at the start, and after every control step.

        Raises:
            InvalidValueError: The policy gave something else than finite float32 residuals, or failed.
        """
        if not keys:
            return
        size = min(self._num_envs, len(keys))
        env = ClutterSlots([self._tasks.choose(*keys[0]).model] * size, self._config, threads=self._threads)
        waiting, running = deque(keys), dict[int, Attempt]()
        self._fill(env, waiting, running)
        yield Round(env=env, running=running, finished=())
        while running:
            acting = np.array(sorted(slot for slot, attempt in running.items() if attempt.row is None), dtype=np.int64)
            if len(acting):
                env.command(acting, self._act(env, acting, running))
            is_unstable = self._advance(env, running)
            finished = tuple(self._finish_holding(env, running, is_unstable))
            finished += tuple(self._finish_acting(env, acting, running, is_unstable[acting]))
            yield Round(env=env, running=running, finished=finished)
            self._fill(env, waiting, running)

    def _fill(self, env: ClutterSlots, waiting: deque[EpisodeKey], running: dict[int, Attempt]) -> None:
        """Start waiting episodes in free slots."""
        free = [slot for slot in range(env.size) if slot not in running][: len(waiting)]
        if not free:
            return
        episodes = [self._episode(*waiting.popleft()) for _ in free]
        slots = np.array(free, dtype=np.int64)
        env.load(slots, [episode.scene_model for episode in episodes], [episode.pair for episode in episodes])
        begin_episodes(self._policy, slots, episodes)
        running.update({slot: Attempt(episode=episode) for slot, episode in zip(free, episodes, strict=True)})

    def _episode(self, scene_id: str, pair: int) -> Episode:
        task = self._tasks.choose(scene_id, pair)
        return Episode(scene=task.scene, pair_index=pair, scene_model=task.model, seed=self._seed)

    def _act(self, env: ClutterSlots, acting: Slots, running: Mapping[int, Attempt]) -> Float32[np.ndarray, "slot 7"]:
        """Ask the policy, and remember what it said."""
        attempts = [running[int(slot)] for slot in acting]
        inputs = PolicyInput(
            slots=acting,
            episodes=tuple(attempt.episode for attempt in attempts),
            steps=np.array([len(attempt.actions) for attempt in attempts]),
            observation=env.observe(acting) if self._policy.needs_observation else None,
            states=env.batch.states[acting].copy() if self._policy.is_privileged else None,
        )
        actions = ask_policy(self._policy, inputs)
        for attempt, action in zip(attempts, actions, strict=True):
            attempt.actions.append(action.copy())
        return actions

    def _advance(self, env: ClutterSlots, running: Mapping[int, Attempt]) -> Bool[np.ndarray, "env"]:
        """One control step; returns which slots of the env became unstable, after saying which episodes these are."""
        slots = np.array(sorted(running), dtype=np.int64)
        is_unstable = np.zeros(env.size, dtype=bool)
        is_unstable[slots] = env.advance(slots)
        for slot in np.flatnonzero(is_unstable):
            attempt, state = running[int(slot)], env.batch.states[slot]
            key, step = (attempt.episode.scene.scene_id, attempt.episode.pair_index), len(attempt.actions) - 1
            report_unstable(self._tasks.sha256, key, step, state, self._unstable_dir)
        return is_unstable

    def _finish_acting(
        self, env: ClutterSlots, acting: Slots, running: dict[int, Attempt], is_unstable: Bool[np.ndarray, "slot"]
    ) -> Iterator[EpisodeRecord]:
        """End the episodes that are over; successes stay to be held."""
        attempts, config = [running[int(slot)] for slot in acting], self._config.termination
        errors, poses = env.errors(acting), env.batch.object_poses[acting]
        outcomes = find_outcome(
            is_success=is_at_goal(errors.position_m, errors.rotation_rad, config),
            dropped=env.is_dropped(acting),
            is_unstable=is_unstable,
            steps=np.array([len(attempt.actions) for attempt in attempts], dtype=np.int64),
            config=config,
        )
        for row, (slot, attempt, outcome) in enumerate(zip(acting.tolist(), attempts, outcomes, strict=True)):
            look = Look.of_row(errors, row, poses[row], env.batch.states[slot])
            if not is_unstable[row]:
                attempt.look(look, config)
            if outcome is None:
                continue
            attempt.end(outcome, look)
            if outcome == "success":
                env.stop_arm(np.array([slot]))
                attempt.hold_left = HOLD_STEPS
            else:
                yield running.pop(slot).to_record(holds=False)

    def _finish_holding(
        self, env: ClutterSlots, running: dict[int, Attempt], is_unstable: Bool[np.ndarray, "env"]
    ) -> Iterator[EpisodeRecord]:
        """Count down the successes that are being held, and look at those whose second is over."""
        for slot in [slot for slot, attempt in sorted(running.items()) if attempt.row is not None]:
            running[slot].hold_left -= 1
            if running[slot].hold_left and not is_unstable[slot]:
                continue
            errors = env.errors(np.array([slot]))
            stands = is_at_goal(errors.position_m, errors.rotation_rad, self._config.termination)
            yield running.pop(slot).to_record(holds=bool(stands[0] and not is_unstable[slot]))
