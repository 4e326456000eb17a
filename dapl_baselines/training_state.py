"""The states of trainings on disk: reading one, and the environments in it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch

from clutter6d.envs.episode_streams import StreamPlaces
from clutter6d.envs.slots import Motion
from clutter6d.envs.vector_env import Snapshot
from clutter6d.errors import Clutter6DError, InvalidFileError
from dapl_baselines.tensor_file import read_tensor_file
from dapl_baselines.training_report import Standing


def go_on_from(path: Path, mark: str, restore: Callable[[dict[str, Any]], None], *, what: str = "training") -> Standing:
    """Put a state back in its place.

    Args:
        path: The file: a dictionary with a ``format``, a standing, and what ``restore`` looks for.
        mark: The format it must have.
        restore: Puts everything else in its place; may stumble over whatever is missing or does not fit.
        what: Of what the state is, for messages.

    Raises:
        InvalidFileError: It is damaged or another training's.
    """
    damaged = f"not the state of this {what}; give another --out, or delete the folder to begin anew"
    state = read_tensor_file(path, what="training state")
    if state.get("format") != mark:
        raise InvalidFileError(path, damaged)
    try:
        restore(state)
        return Standing.of_state(state)
    except (KeyError, TypeError, ValueError, AttributeError, RuntimeError, IndexError, Clutter6DError) as error:
        reason = " ".join(str(error).split())[:120]
        raise InvalidFileError(path, f"{damaged} ({type(error).__name__}: {reason})") from None


def take_up(path: Path, restore: Callable[[dict[str, Any]], None]) -> None:
    """Put the state of a training by steps back in its place.

    Args:
        path: The file.
        restore: Puts everything in its place; may stumble over whatever is missing or does not fit.

    Raises:
        InvalidFileError: It is damaged or another training's.
    """
    state = read_tensor_file(path, what="state of a training")
    try:
        restore(state)
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        detail = " ".join(str(error).split())[:200]
        raise InvalidFileError(path, f"not the state of this training: {detail}; delete it to start anew") from None


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
