"""The state of a policy training between two iterations, as plain values and tensors for one file."""

from copy import deepcopy
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import torch

from dapl_baselines.policy.rollout_env import RolloutEnv
from dapl_baselines.policy.rsl_runner import RslRunner
from dapl_baselines.training_report import Standing
from dapl_baselines.training_state import go_on_from, pack_snapshot, unpack_snapshot

FORMAT: Final = "clutter6d-policy-training-1"


def copy_training_state(standing: Standing, runner: RslRunner, env: RolloutEnv) -> dict[str, object]:
    """A copy of all that decides how the training goes on, for one file.

    That is: networks, optimiser with its learning rate, random numbers, and every environment's simulation. Of
    environments on a GPU, whose simulation is not deterministic, nothing is kept: they begin new episodes.
    """
    state: dict[str, object] = {
        "format": FORMAT,
        **asdict(standing),
        "algorithm": deepcopy(runner.alg.save()),
        "random": torch.get_rng_state(),
    }
    if env.can_be_restored:
        state |= {"running": env.tally.running.clone(), "environments": pack_snapshot(env.snapshot())}
    return state


def read_training_state(path: Path, runner: RslRunner, env: RolloutEnv) -> Standing:
    """Go on from a state: everything it holds is put back in its place.

    Raises:
        InvalidFileError: It is damaged or another training's.
    """

    def restore(state: dict[str, Any]) -> None:
        runner.alg.load(state["algorithm"], None, strict=True)
        if env.can_be_restored:
            env.restore(unpack_snapshot(state["environments"]))
            env.tally.running.copy_(state["running"])
        torch.set_rng_state(state["random"])

    standing = go_on_from(path, FORMAT, restore)
    runner.current_learning_iteration = standing.iteration
    return standing
