"""Gymnasium's ``info``, for many environments and for one.

A vector environment's ``info`` has one array an entry, and beside each entry ``name`` a mask ``_name`` that tells which
environments have it. ``docs/environments.md`` lists the entries.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Bool

from clutter6d.envs.episodes import StepResult
from clutter6d.envs.slots import Slots
from clutter6d.envs.tasks import Task
from clutter6d.envs.termination import GoalErrors

Info = dict[str, Any]


def describe_start(tasks: Sequence[Task], errors: GoalErrors) -> Info:
    """Entries that every environment has, after a reset as after a step; one row each."""
    return {
        "scene_id": _objects([task.scene.scene_id for task in tasks]),
        "pair": np.array([task.pair_index for task in tasks], dtype=np.int64),
        "position_error_m": errors.position_m,
        "planar_error_m": errors.planar_m,
        "rotation_error_rad": errors.rotation_rad,
    }


def describe_step(result: StepResult) -> Info:
    """Entries of environments that made a step; one row each."""
    reward = result.reward
    return {
        "reward_terms": {
            "proximity": reward.proximity,
            "coarse": reward.coarse,
            "fine": reward.fine,
            "success": reward.success,
        },
        "outcome": _objects(result.outcomes),
        "is_success": np.array([outcome == "success" for outcome in result.outcomes], dtype=bool),
    }


def spread(info: Mapping[str, Any], rows: Slots, size: int) -> Info:
    """Put rows at their environments' places, zero or ``None`` elsewhere, with masks.

    Args:
        info: Entries with one row for each of ``rows``.
        rows: The environments.
        size: Number of environments.
    """
    mask = np.zeros(size, dtype=bool)
    mask[rows] = True
    out: Info = {}
    if not len(rows):
        return out
    for name, value in info.items():
        out[name] = spread(value, rows, size) if isinstance(value, Mapping) else _spread_array(value, rows, size)
        out[f"_{name}"] = mask.copy()
    return out


def restrict(info: Mapping[str, Any], mask: Bool[np.ndarray, "env"]) -> Info:
    """Keep the entries of some environments; an entry that none of them has is left out."""
    rows, out = np.flatnonzero(mask), Info()
    for name, value in info.items():
        if name.startswith("_") or not (info[f"_{name}"] & mask).any():
            continue
        out[name] = restrict(value, mask) if isinstance(value, Mapping) else _spread_array(value[rows], rows, len(mask))
        out[f"_{name}"] = info[f"_{name}"] & mask
    return out


def overlay(info: Info, other: Mapping[str, Any]) -> Info:
    """Put another's entries over these, where the other's masks tell that it has them; changes and returns ``info``."""
    for name, value in other.items():
        mask = other.get(f"_{name}")
        if name not in info:
            info[name] = value
        elif mask is None:
            info[name] |= value
        elif isinstance(value, Mapping):
            overlay(info[name], value)
        else:
            info[name][mask] = value[mask]
    return info


def of_one(info: Mapping[str, Any]) -> Info:
    """The ``info`` of the only environment of a vector environment."""
    out: Info = {}
    for name, value in info.items():
        if name.startswith("_") or not info[f"_{name}"][0]:
            continue
        out[name] = of_one(value) if isinstance(value, Mapping) else _plain(value[0])
    return out


def _spread_array(value: np.ndarray, rows: Slots, size: int) -> np.ndarray:
    out = np.empty((size, *value.shape[1:]), dtype=value.dtype)
    out[:] = None if value.dtype == object else 0
    out[rows] = value
    return out


def _objects(values: Sequence[object]) -> np.ndarray:
    out = np.empty(len(values), dtype=object)
    out[:] = values
    return out


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
