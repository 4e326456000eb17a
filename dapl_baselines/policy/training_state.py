"""The state of a policy training between two iterations, as plain values and tensors for one file."""

from copy import deepcopy
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import torch

from clutter6d.envs.episode_streams import StreamPlaces
from clutter6d.envs.slots import Motion
from clutter6d.envs.vector_env import Snapshot
from clutter6d.errors import Clutter6DError, InvalidFileError
from dapl_baselines.policy.rollout_env import RolloutEnv
from dapl_baselines.policy.rsl_runner import RslRunner
from dapl_baselines.tensor_file import read_tensor_file
from dapl_baselines.training_report import Standing

FORMAT: Final = "clutter6d-policy-training-1"
_DAMAGED = "not the state of this training; give another --out, or delete the folder to begin anew"


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
    state = read_tensor_file(path, what="training state")
    if state.get("format") != FORMAT:
        raise InvalidFileError(path, _DAMAGED)
    try:
        runner.alg.load(state["algorithm"], None, strict=True)
        if env.can_be_restored:
            env.restore(unpack_snapshot(state["environments"]))
            env.tally.running.copy_(state["running"])
        torch.set_rng_state(state["random"])
        standing = Standing.of_state(state)
    except (KeyError, TypeError, ValueError, AttributeError, RuntimeError, IndexError, Clutter6DError) as error:
        reason = " ".join(str(error).split())[:120]
        raise InvalidFileError(path, f"{_DAMAGED} ({type(error).__name__}: {reason})") from None
    runner.current_learning_iteration = standing.iteration
    return standing


def pack_snapshot(snapshot: Snapshot) -> dict[str, object]:
    """Where environments are, as plain values and tensors for a file."""
    places, motion = snapshot.places, snapshot.motion
    return {
        "seeds": list(places.seeds),
        "numbers": list(places.numbers),
        "scene_ids": list(places.scene_ids),
        "pairs": list(places.pairs),
        "states": torch.from_numpy(motion.states),
        "steps": torch.from_numpy(motion.steps),
        "previous_actions": torch.from_numpy(motion.previous_actions),
        "targets_before": torch.from_numpy(motion.targets_before),
        "is_over": torch.from_numpy(snapshot.is_over),
        "training_step": snapshot.training_step,
        "action_scale_rad": snapshot.action_scale_rad,
    }


def unpack_snapshot(state: dict[str, Any]) -> Snapshot:
    """The same from a file; a name that is missing is a ``KeyError``."""
    arrays = {name: value.numpy() for name, value in state.items() if isinstance(value, torch.Tensor)}
    return Snapshot(
        places=StreamPlaces(
            seeds=tuple(state["seeds"]),
            numbers=tuple(state["numbers"]),
            scene_ids=tuple(state["scene_ids"]),
            pairs=tuple(state["pairs"]),
        ),
        motion=Motion(
            states=arrays["states"],
            steps=arrays["steps"],
            previous_actions=arrays["previous_actions"],
            targets_before=arrays["targets_before"],
        ),
        is_over=arrays["is_over"],
        training_step=int(state["training_step"]),
        action_scale_rad=float(state["action_scale_rad"]),
    )
