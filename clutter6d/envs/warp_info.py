"""``info`` of environments on a GPU: one row an environment, and beside each entry ``name`` a mask ``_name``.

The entries are those of :mod:`clutter6d.envs.info`. Numbers are tensors on the device; ``outcome`` is an index of
:data:`~clutter6d.envs.termination.OUTCOMES`, -1 without one. ``scene_id`` and ``pair`` are NumPy arrays on the host.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Int

from clutter6d.envs.reward import RewardTerms
from clutter6d.envs.tasks import Task
from clutter6d.envs.termination import OUTCOMES, GoalErrors
from clutter6d.sim.warp_runtime import torch

DeviceInfo = dict[str, Any]
_SUCCESS = OUTCOMES.index("success")


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TaskNames:
    """Scene and pair of each environment, on the host; made anew when one changes."""

    scene_ids: np.ndarray
    pairs: Int[np.ndarray, "env"]

    @classmethod
    def of(cls, tasks: Sequence[Task]) -> "TaskNames":
        """The names of tasks."""
        scene_ids = np.empty(len(tasks), dtype=object)
        scene_ids[:] = [task.scene.scene_id for task in tasks]
        return cls(scene_ids=scene_ids, pairs=np.array([task.pair_index for task in tasks], dtype=np.int64))


def describe_start(names: TaskNames, errors: GoalErrors[torch.Tensor], mask: Bool[torch.Tensor, "env"]) -> DeviceInfo:
    """Entries that every environment has, after a reset as after a step."""
    info = {
        "scene_id": names.scene_ids,
        "pair": names.pairs,
        "position_error_m": errors.position_m,
        "planar_error_m": errors.planar_m,
        "rotation_error_rad": errors.rotation_rad,
    }
    return _with_masks(info, mask)


def describe_step(
    reward: RewardTerms[torch.Tensor], outcomes: Int[torch.Tensor, "env"], acting: Bool[torch.Tensor, "env"]
) -> DeviceInfo:
    """Entries of environments that made a step; zero elsewhere."""
    terms = {
        "proximity": reward.proximity,
        "coarse": reward.coarse,
        "fine": reward.fine,
        "success": reward.success,
    }
    seen = {name: torch.where(acting, value, 0.0) for name, value in terms.items()}
    info = {"reward_terms": _with_masks(seen, acting), "outcome": outcomes, "is_success": outcomes == _SUCCESS}
    return _with_masks(info, acting)


def end_of_episode(
    last: dict[str, torch.Tensor], info: DeviceInfo, started: DeviceInfo, ended: Bool[torch.Tensor, "env"]
) -> DeviceInfo:
    """The ``info`` of a step after which some environments began anew.

    Args:
        last: What was seen before they did.
        info: What was known before they did.
        started: What is known of all episodes that now run.
        ended: Which environments.

    Returns:
        As after a reset for these, as after a step for the others; ``final_obs`` and ``final_info`` are full-sized,
        and ``_final_obs`` and ``_final_info`` say whose rows count.
    """
    return {
        **_without(info, ended),
        **started,
        "final_obs": last,
        "_final_obs": ended,
        "final_info": info,
        "_final_info": ended,
    }


def _without(info: DeviceInfo, ended: Bool[torch.Tensor, "env"]) -> DeviceInfo:
    """The same entries, with masks that leave some environments out."""
    out: DeviceInfo = {}
    for name, value in info.items():
        if isinstance(value, dict):
            out[name] = _without(value, ended)
        else:
            out[name] = value & ~ended if name.startswith("_") else value
    return out


def _with_masks(info: DeviceInfo, mask: Bool[torch.Tensor, "env"]) -> DeviceInfo:
    return {**info, **{f"_{name}": mask for name in info}}
