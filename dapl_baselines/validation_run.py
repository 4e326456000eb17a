"""How good a policy is on the validation scenes, while it is trained."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import MAX_CONTROL_STEPS, TerminationConfig
from clutter6d.eval.episode import EpisodeRow
from clutter6d.eval.policy import Policy
from clutter6d.eval.runner import EpisodeRunner
from dapl_baselines.validation import SceneSubset

PARALLEL_EPISODES: Final = 32
"""As many rows as a network is given at once (:mod:`dapl_baselines.fixed_batches`)."""

Observer = Callable[[str, int, int], None]


def ignore(_name: str, _done: int, _total: int) -> None:
    """Nobody watches."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ValidationResult:
    """Means over the episodes.

    Attributes:
        episodes: How many.
        success_rate: Share that ended at the goal, as the benchmark defines it.
        mean_offset_cm: Mean offset of the other objects.
        position_error_m: Distance to the goal at the end.
        rotation_error_rad: Angle to the goal at the end.
        steps: Control steps.
    """

    episodes: int
    success_rate: float
    mean_offset_cm: float
    position_error_m: float
    rotation_error_rad: float
    steps: float


def run_validation(
    policy: Policy,
    scenes: SceneSubset,
    *,
    pairs: int = 1,
    max_steps: int = MAX_CONTROL_STEPS,
    num_envs: int = PARALLEL_EPISODES,
    threads: int = 0,
    observe: Observer = ignore,
) -> ValidationResult:
    """Attempt the first goal pairs of every scene, as ``clutter6d evaluate --pairs 1`` does.

    Args:
        policy: What acts.
        scenes: The validation scenes.
        pairs: Goal pairs of each.
        max_steps: Control steps of an episode at most.
        num_envs: Episodes that run at once, at most.
        threads: Threads of the simulation; 0 for all cores.
        observe: Told the name of what is done, how much is, and of how much, whenever an episode ends.
    """
    config = EnvConfig(termination=TerminationConfig(max_steps=max_steps))
    runner = EpisodeRunner(scenes, policy, config=config, num_envs=num_envs, threads=threads)
    keys, rows = [(scene.scene_id, pair) for pair in range(pairs) for scene in scenes.scenes], list[EpisodeRow]()
    for record in runner.run(keys):
        rows.append(record.row)
        observe("validation", len(rows), len(keys))
    return ValidationResult(
        episodes=len(rows),
        success_rate=float(np.mean([row.is_success for row in rows])),
        mean_offset_cm=float(np.mean([row.mean_offset_cm for row in rows])),
        position_error_m=float(np.mean([row.position_error_m for row in rows])),
        rotation_error_rad=float(np.mean([row.rotation_error_rad for row in rows])),
        steps=float(np.mean([row.steps for row in rows])),
    )
