"""What a policy is; :mod:`clutter6d.eval.policy_loading` finds one by name.

A policy serves many slots at once; each slot runs one episode after another. What it does in one slot must not depend
on the other slots: on how many there are, on their order, or on their scenes.
"""

import hashlib
import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32, Float64, Int

from clutter6d.envs.action import ACTION_SIZE
from clutter6d.envs.observation import Observation
from clutter6d.errors import Clutter6DError, InvalidValueError
from clutter6d.scene import GoalPair, Scene
from clutter6d.schema import canonical_json
from clutter6d.sim.scene_model import SceneModel

_log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Episode:
    """One attempt at one goal pair.

    Attributes:
        scene: The scene.
        pair_index: Which of its goal pairs.
        scene_model: The compiled scene.
        seed: The evaluation's seed; draw only from ``generator(seed, scene_id, pair_index, ...)``.
    """

    scene: Scene
    pair_index: int
    scene_model: SceneModel
    seed: int

    @property
    def pair(self) -> GoalPair:
        """The goal pair: where the target starts and where it must go."""
        return self.scene.goal_pairs[self.pair_index]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PolicyInput:
    """What a policy may look at; row ``i`` of everything belongs to slot ``slots[i]``.

    Attributes:
        slots: The slots that need an action now.
        episodes: The episode each of them runs.
        steps: Control steps each episode has made.
        observation: The observations, or ``None`` if the policy does not need them.
        states: Full integration state rows of the simulation, laid out as ``SceneBatch.states``; ``None`` unless the
            policy is privileged.
    """

    slots: Int[np.ndarray, "slot"]
    episodes: tuple[Episode, ...]
    steps: Int[np.ndarray, "slot"]
    observation: Observation | None
    states: Float64[np.ndarray, "slot state"] | None


@runtime_checkable
class Policy(Protocol):
    """Observation to action."""

    @property
    def name(self) -> str:
        """Its name in tables."""
        ...

    @property
    def policy_hash(self) -> str:
        """SHA-256 over everything its actions depend on: method, settings, weights."""
        ...

    @property
    def is_privileged(self) -> bool:
        """Whether it reads the simulation's full state."""
        ...

    @property
    def needs_observation(self) -> bool:
        """Whether it reads the observation."""
        ...

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:
        """Episodes start in slots: forget what was remembered of them."""
        ...

    def act(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
        """Joint residuals [rad], one row for each of ``inputs.slots``."""
        ...


def is_planner(policy: Policy) -> bool:
    """Whether a policy plans in the simulator, for seconds an episode: it reads the state and no observation."""
    return policy.is_privileged and not policy.needs_observation


@dataclass(frozen=True, kw_only=True, slots=True)
class PolicyOptions:
    """What a policy's factory is told.

    Attributes:
        seed: The evaluation's seed.
        threads: Threads it may use; 0 for all cores. Must not change its actions.
    """

    seed: int = 0
    threads: int = 0


PolicyFactory = Callable[[PolicyOptions], Policy]
"""What ``package.module:factory`` and the entry points of ``clutter6d.policies`` name."""


def identity_hash(name: str, settings: object = None) -> str:
    """SHA-256 of a method's name (with its version) and JSON-like settings: a ``policy_hash``."""
    return hashlib.sha256(canonical_json([name, settings])).hexdigest()


@contextmanager
def blaming(what: str) -> Iterator[None]:
    """Turn whatever a policy's own code raises into one line that names it.

    Raises:
        InvalidValueError: The code inside raised something that is not an error of this package.
    """
    try:
        yield
    except Clutter6DError:
        raise
    except Exception as error:
        _log.debug("%s failed", what, exc_info=True)
        detail = " ".join(f"{type(error).__name__}: {error}".split())
        raise InvalidValueError(f"{what} failed: {detail}") from error


def begin_episodes(policy: Policy, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:
    """Tell the policy that episodes start.

    Raises:
        InvalidValueError: The policy failed.
    """
    with blaming(f"policy '{policy.name}'"):
        policy.begin(slots, episodes)


def ask_policy(policy: Policy, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
    """The policy's actions, checked.

    Raises:
        InvalidValueError: The policy gave something else than finite float32 residuals, or failed.
    """
    with blaming(f"policy '{policy.name}'"):
        actions: object = policy.act(inputs)
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
