"""What a policy is, and how one is found by name.

A policy serves many slots at once; each slot runs one episode after another. What it does in one slot must not depend
on the other slots: on how many there are, on their order, or on their scenes.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Protocol, cast, runtime_checkable

import numpy as np
from jaxtyping import Float32, Float64, Int

from clutter6d.envs.observation import Observation
from clutter6d.errors import (
    Clutter6DError,
    InvalidValueError,
    MissingDependencyError,
    MissingFileError,
    UnknownNameError,
)
from clutter6d.scene import GoalPair, Scene
from clutter6d.schema import canonical_json
from clutter6d.sim.scene_model import SceneModel

ENTRY_POINT_GROUP = "clutter6d.policies"
CHECKPOINT_ENTRY_POINT = "checkpoint"


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


def load_policy(spec: str, options: PolicyOptions | None = None) -> Policy:
    """Make a policy from what stands behind ``--policy``.

    Args:
        spec: A name (``zero``, ``random``, ``planner``, ...), ``package.module:factory``, or a ``.pt`` checkpoint.
        options: Seed and threads.

    Raises:
        UnknownNameError: No such name, module or factory.
        MissingFileError: No such checkpoint.
        InvalidFileError: The checkpoint is not acceptable.
        MissingDependencyError: The policy needs a package that is not installed.
        InvalidValueError: The module or factory fails.
    """
    chosen = options or PolicyOptions()
    known = {point.name: point for point in entry_points(group=ENTRY_POINT_GROUP)}
    if Path(spec).suffix == ".pt":
        return _load_checkpoint(Path(spec), chosen, known)
    names = [name for name in known if name != CHECKPOINT_ENTRY_POINT]
    if spec in names:
        factory = _import(spec, known[spec].value, names)
    elif ":" in spec:
        factory = _import(spec, spec, names)
    else:
        raise UnknownNameError("policy", spec, [*names, "package.module:factory", "checkpoint.pt"])
    return _checked(spec, _call(spec, cast(PolicyFactory, factory), chosen))


def _load_checkpoint(path: Path, options: PolicyOptions, known: dict[str, EntryPoint]) -> Policy:
    if not path.is_file():
        raise MissingFileError("checkpoint", path)
    if CHECKPOINT_ENTRY_POINT not in known:
        raise MissingDependencyError(f"no package that reads checkpoints is installed, needed for {path}")
    point = known[CHECKPOINT_ENTRY_POINT]
    loader = cast(Callable[[Path, PolicyOptions], Policy], _import(point.name, point.value, known))
    return _checked(str(path), loader(path, options))


def _import(spec: str, target: str, known: Sequence[str] | dict[str, EntryPoint]) -> object:
    module_name, _, attribute = target.partition(":")
    if not all(part.isidentifier() for part in [*module_name.split("."), attribute]):
        raise InvalidValueError(f"policy '{spec}' is not of the form package.module:factory")
    try:
        module = import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name and (module_name == error.name or module_name.startswith(f"{error.name}.")):
            raise UnknownNameError("policy module", module_name, known) from None
        raise MissingDependencyError(f"policy '{spec}' needs the package '{error.name}': {_line(error)}") from None
    except Clutter6DError:
        raise
    except Exception as error:  # noqa: BLE001  a user's module may fail in any way; the message says how
        raise InvalidValueError(f"policy '{spec}': importing {module_name} failed: {_line(error)}") from None
    factory = getattr(module, attribute, None)
    if not callable(factory):
        callables = [name for name in dir(module) if callable(getattr(module, name)) and not name.startswith("_")]
        raise UnknownNameError(f"factory in {module_name}", attribute, callables)
    return factory


def _call(spec: str, factory: PolicyFactory, options: PolicyOptions) -> object:
    try:
        return factory(options)
    except TypeError as error:
        raise InvalidValueError(f"policy '{spec}': the factory does not take PolicyOptions: {_line(error)}") from None


def _checked(spec: str, policy: object) -> Policy:
    wanted = ("name", "policy_hash", "is_privileged", "needs_observation", "begin", "act")
    missing = [name for name in wanted if not hasattr(policy, name)]
    if missing:
        raise InvalidValueError(f"policy '{spec}' is a {type(policy).__name__} without '{missing[0]}'")
    return cast(Policy, policy)


def _line(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
