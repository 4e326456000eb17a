"""Running episodes: many at once in slots, each slot given the next episode when its own ends."""

import hashlib
import logging
import time
from collections import OrderedDict, deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int

from clutter6d.assets.asset import Asset
from clutter6d.envs.action import ACTION_SIZE
from clutter6d.envs.termination import GoalErrors, Outcome, find_outcome, is_at_goal, is_dropped
from clutter6d.envs.vector_env import ClutterVectorEnv, EnvConfig
from clutter6d.errors import Clutter6DError, InvalidValueError
from clutter6d.eval.episode import EpisodeRecord, EpisodeRow, actions_sha256
from clutter6d.eval.metrics import mean_offset_cm, symmetric_rotation_error_rad
from clutter6d.eval.policy import Episode, Policy, PolicyInput
from clutter6d.physics import CONTROL_STEP_S
from clutter6d.scene import Scene
from clutter6d.sim.scene_model import SceneModel, compile_stored_scene

HOLD_STEPS = round(1.0 / CONTROL_STEP_S)
"""Control steps for which a success must stand after the robot has stopped: 1 s."""

_log = logging.getLogger(__name__)
Slots = Int[np.ndarray, "slot"]
EpisodeKey = tuple[str, int]


class EpisodeScenes(Protocol):
    """Where scenes and their assets come from; a ``SceneSet`` is one."""

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """All scenes, by id."""
        ...

    @property
    def sha256(self) -> str:
        """Names exactly this set of scenes."""
        ...

    def assets_of(self, scene: Scene) -> Mapping[str, Asset]:
        """The assets of a scene by content hash."""
        ...


@dataclass(kw_only=True, slots=True, eq=False)
class _Attempt:
    """An episode under way; ``row`` is set when it has ended and its success is being held."""

    episode: Episode
    started: float
    actions: list[Float32[np.ndarray, "7"]] = field(default_factory=list)
    met_planar: bool = False
    met_symmetric: bool = False
    row: EpisodeRow | None = None
    hold_left: int = 0


class EpisodeRunner:
    """Runs a list of episodes; what comes of one depends on its scene, pair, policy and seed alone.

    Args:
        scenes: Scenes and assets.
        policy: What acts.
        config: Actions and termination.
        seed: The evaluation's seed.
        num_envs: Episodes that run at once, at most.
        threads: Threads of the simulation; 0 for all cores.

    Raises:
        InvalidValueError: There is not at least one environment.
    """

    def __init__(
        self,
        scenes: EpisodeScenes,
        policy: Policy,
        *,
        config: EnvConfig | None = None,
        seed: int = 0,
        num_envs: int = 16,
        threads: int = 0,
    ) -> None:
        if num_envs < 1:
            raise InvalidValueError(f"num-envs is {num_envs}; at least 1 is needed")
        self._scenes = {scene.scene_id: scene for scene in scenes.scenes}
        self._source, self._policy = scenes, policy
        self._config, self._seed = config or EnvConfig(), seed
        self._num_envs, self._threads = num_envs, threads
        self._models: OrderedDict[str, SceneModel] = OrderedDict()

    def run(self, keys: Sequence[EpisodeKey]) -> Iterator[EpisodeRecord]:
        """Run episodes named by scene and pair, and yield each as it finishes.

        Raises:
            InvalidValueError: The policy gave something else than finite float32 residuals, or failed.
        """
        if not keys:
            return
        size = min(self._num_envs, len(keys))
        env = ClutterVectorEnv([self._model(keys[0][0])] * size, self._config, threads=self._threads)
        waiting, running = deque(keys), dict[int, _Attempt]()
        while waiting or running:
            self._fill(env, waiting, running)
            acting = np.array(sorted(slot for slot, attempt in running.items() if attempt.row is None), dtype=np.int64)
            if len(acting):
                env.command(acting, self._act(env, acting, running))
            slots = np.array(sorted(running), dtype=np.int64)
            before = env.batch.states[slots].copy()
            unstable = env.advance(slots)
            env.batch.states[slots[unstable]] = before[unstable]
            is_unstable = dict(zip(slots.tolist(), unstable.tolist(), strict=True))
            yield from self._finish_holding(env, running, is_unstable)
            yield from self._finish_acting(env, acting, running, np.array([is_unstable[int(slot)] for slot in acting]))

    def _model(self, scene_id: str) -> SceneModel:
        """The compiled scene; those not used for longest are forgotten."""
        if scene_id not in self._models:
            scene = self._scenes[scene_id]
            self._models[scene_id] = compile_stored_scene(scene, self._source.assets_of(scene))
            if len(self._models) > self._num_envs:
                self._models.popitem(last=False)
        self._models.move_to_end(scene_id)
        return self._models[scene_id]

    def _fill(self, env: ClutterVectorEnv, waiting: deque[EpisodeKey], running: dict[int, _Attempt]) -> None:
        """Start waiting episodes in free slots."""
        free = [slot for slot in range(env.size) if slot not in running][: len(waiting)]
        if not free:
            return
        episodes = [self._episode(*waiting.popleft()) for _ in free]
        slots = np.array(free, dtype=np.int64)
        env.load(slots, [episode.scene_model for episode in episodes], [episode.pair for episode in episodes])
        self._policy.begin(slots, episodes)
        for slot, episode in zip(free, episodes, strict=True):
            running[slot] = _Attempt(episode=episode, started=time.monotonic())

    def _episode(self, scene_id: str, pair: int) -> Episode:
        scene = self._scenes[scene_id]
        return Episode(scene=scene, pair_index=pair, scene_model=self._model(scene_id), seed=self._seed)

    def _act(
        self, env: ClutterVectorEnv, acting: Slots, running: Mapping[int, _Attempt]
    ) -> Float32[np.ndarray, "slot 7"]:
        """Ask the policy, and remember what it said."""
        attempts = [running[int(slot)] for slot in acting]
        inputs = PolicyInput(
            slots=acting,
            episodes=tuple(attempt.episode for attempt in attempts),
            steps=np.array([len(attempt.actions) for attempt in attempts]),
            observation=env.observe(acting) if self._policy.needs_observation else None,
            states=env.batch.states[acting].copy() if self._policy.is_privileged else None,
        )
        actions = _ask(self._policy, inputs)
        for attempt, action in zip(attempts, actions, strict=True):
            attempt.actions.append(action.copy())
        return actions

    def _finish_acting(
        self, env: ClutterVectorEnv, acting: Slots, running: dict[int, _Attempt], is_unstable: Bool[np.ndarray, "slot"]
    ) -> Iterator[EpisodeRecord]:
        """End the episodes that are over; successes stay to be held."""
        if not len(acting):
            return
        attempts, config = [running[int(slot)] for slot in acting], self._config.termination
        errors, poses = env.errors(acting), env.batch.object_poses[acting]
        success = is_at_goal(errors.position_m, errors.rotation_rad, config) & ~is_unstable
        planar = is_at_goal(errors.planar_m, errors.rotation_rad, config) & ~is_unstable
        near = (errors.position_m < config.position_tolerance_m) & ~is_unstable
        outcomes = find_outcome(
            is_success=success,
            dropped=is_dropped(poses, config),
            is_unstable=is_unstable,
            steps=np.array([len(attempt.actions) for attempt in attempts]),
            config=config,
        )
        for row, (slot, attempt, outcome) in enumerate(zip(acting.tolist(), attempts, outcomes, strict=True)):
            attempt.met_planar |= bool(planar[row])
            if near[row] and not attempt.met_symmetric:
                attempt.met_symmetric = _symmetric_error(attempt.episode, poses[row]) < config.rotation_tolerance_rad
            if outcome is None:
                continue
            attempt.row = _make_row(attempt, outcome, _Final(errors, row, poses[row], env.batch.states[slot]))
            if outcome == "success":
                env.stop_arm(np.array([slot]))
                attempt.hold_left = HOLD_STEPS
            else:
                yield _to_record(running.pop(slot), holds=False)

    def _finish_holding(
        self, env: ClutterVectorEnv, running: dict[int, _Attempt], is_unstable: Mapping[int, bool]
    ) -> Iterator[EpisodeRecord]:
        """Count down the successes that are being held, and look at those whose second is over."""
        for slot in [slot for slot, attempt in sorted(running.items()) if attempt.row is not None]:
            running[slot].hold_left -= 1
            if running[slot].hold_left and not is_unstable[slot]:
                continue
            errors = env.errors(np.array([slot]))
            holds = is_at_goal(errors.position_m, errors.rotation_rad, self._config.termination)
            yield _to_record(running.pop(slot), holds=bool(holds[0]) and not is_unstable[slot])


@dataclass(frozen=True, slots=True, eq=False)
class _Final:
    """What an episode ended with: its row of the errors, the objects' poses, the full state."""

    errors: GoalErrors
    index: int
    poses: Float64[np.ndarray, "object 7"]
    state: Float64[np.ndarray, "state"]


def _ask(policy: Policy, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
    """The policy's actions, checked."""
    try:
        actions = policy.act(inputs)
    except Clutter6DError:
        raise
    except Exception as error:
        _log.debug("policy failed", exc_info=True)
        detail = " ".join(f"{type(error).__name__}: {error}".split())
        raise InvalidValueError(f"policy '{policy.name}' failed: {detail}") from error
    wanted = (len(inputs.slots), ACTION_SIZE)
    if not isinstance(actions, np.ndarray) or actions.dtype != np.float32 or actions.shape != wanted:
        found = f"{actions.dtype}{actions.shape}" if isinstance(actions, np.ndarray) else type(actions).__name__
        raise InvalidValueError(f"policy '{policy.name}' gave {found} as actions, expected float32{wanted}")
    bad = np.flatnonzero(~np.isfinite(actions).all(axis=1))
    if len(bad):
        episode, step = inputs.episodes[bad[0]], inputs.steps[bad[0]]
        where = f"scene {episode.scene.scene_id}, pair {episode.pair_index}, step {step}"
        raise InvalidValueError(f"policy '{policy.name}' gave an action that is not finite at {where}")
    return actions


def _symmetric_error(episode: Episode, poses: Float64[np.ndarray, "object 7"]) -> float:
    goal = np.array(episode.pair.goal.quat_wxyz)
    return symmetric_rotation_error_rad(poses[0, 3:], goal, episode.scene_model.assets[0].symmetry)


def _make_row(attempt: _Attempt, outcome: Outcome, final: _Final) -> EpisodeRow:
    episode = attempt.episode
    return EpisodeRow(
        scene_id=episode.scene.scene_id,
        pair=episode.pair_index,
        track=episode.scene.track,
        outcome=outcome,
        steps=len(attempt.actions),
        is_success=outcome == "success",
        is_planar_success=attempt.met_planar,
        is_symmetric_success=attempt.met_symmetric,
        holds=False,
        position_error_m=float(final.errors.position_m[final.index]),
        planar_error_m=float(final.errors.planar_m[final.index]),
        rotation_error_rad=float(final.errors.rotation_rad[final.index]),
        symmetric_rotation_error_rad=_symmetric_error(episode, final.poses),
        mean_offset_cm=mean_offset_cm(episode.scene_model.assets, episode.pair.object_poses, final.poses),
        actions_sha256=actions_sha256(np.stack(attempt.actions)),
        final_state_sha256=hashlib.sha256(final.state.tobytes()).hexdigest(),
        timing_seconds=0.0,
    )


def _to_record(attempt: _Attempt, *, holds: bool) -> EpisodeRecord:
    assert attempt.row is not None
    seconds = round(time.monotonic() - attempt.started, 3)
    row = attempt.row.model_copy(update={"holds": holds, "timing_seconds": seconds})
    return EpisodeRecord(row=row, actions=np.stack(attempt.actions))
