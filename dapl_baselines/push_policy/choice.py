"""Pushes judged by a critic, from arrays to arrays."""

import numpy as np
import torch
from jaxtyping import Float, Float32

from dapl_baselines.push_policy.critic import PushCritic
from dapl_baselines.push_policy.push_frame import view_pushes
from dapl_baselines.push_policy.push_state import PushState


def judge(
    critic: PushCritic,
    state: PushState[np.ndarray],
    goals: Float[np.ndarray, "row 7"],
    surface: Float32[np.ndarray, "row point 3"],
    pushes: Float[np.ndarray, "row push column"],
) -> Float32[np.ndarray, "row push"]:
    """What each push is worth.

    Args:
        critic: The network.
        state: Where things are.
        goals: Where the targets shall go.
        surface: Surface points of the targets, in their own frames [m].
        pushes: What is judged.
    """
    tensors = (torch.from_numpy(np.asarray(array, dtype=np.float32)) for array in (goals, surface, pushes))
    with torch.inference_mode():
        return critic(view_pushes(state.to_tensors(), *tensors)).value.numpy()
