"""Where slots that push are, as plain values and tensors for a file."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
import torch

from clutter6d.envs.vector_env import Snapshot
from dapl_baselines.push_policy.push_slots import PushSlots
from dapl_baselines.training_state import pack_snapshot, unpack_snapshot


def pack_slots(slots: PushSlots) -> dict[str, object]:
    """Episodes, what is carried out in them, and their tally; they are paused for it."""
    places, motion = slots.places, slots.pause()
    snapshot = Snapshot(
        places=places,
        motion=motion,
        is_over=np.zeros(len(motion.steps), dtype=bool),
        training_step=0,
        action_scale_rad=0.0,
    )
    return {
        "environments": pack_snapshot(snapshot),
        "tracker": pack_arrays(_tracker_arrays(slots)),
        "running": slots.tally.running.clone(),
    }


def restore_slots(slots: PushSlots, state: Mapping[str, Any]) -> None:
    """Put all that back in its place; a name that is missing is a ``KeyError``."""
    snapshot = unpack_snapshot(state["environments"])
    slots.return_to(snapshot.places, snapshot.motion)
    slots.tally.running.copy_(state["running"])
    restore_arrays(_tracker_arrays(slots), state["tracker"])


def pack_arrays(arrays: Mapping[str, np.ndarray]) -> dict[str, torch.Tensor]:
    """A copy of arrays as tensors."""
    return {name: torch.from_numpy(array.copy()) for name, array in arrays.items()}


def restore_arrays(arrays: Mapping[str, np.ndarray], state: Mapping[str, torch.Tensor]) -> None:
    """Fill arrays from tensors of the same names."""
    for name, array in arrays.items():
        array[:] = state[name].numpy()


def _tracker_arrays(slots: PushSlots) -> dict[str, np.ndarray]:
    arrays = {field.name: getattr(slots.tracker, field.name) for field in fields(slots.tracker)}
    return {name: array for name, array in arrays.items() if isinstance(array, np.ndarray)}
