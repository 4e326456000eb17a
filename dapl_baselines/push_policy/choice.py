"""Pushes judged by a critic, from arrays to arrays."""

from collections.abc import Callable

import numpy as np
import torch
from jaxtyping import Float, Float32

from dapl_baselines.push_policy.critic import Judgement
from dapl_baselines.push_policy.push_frame import PushView, view_pushes
from dapl_baselines.push_policy.push_state import PushState, to_tensor

Critic = Callable[[PushView], Judgement]


def judge(
    critic: Critic,
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
    with torch.inference_mode():
        return critic(look_at_pushes(state, goals, surface, pushes)).value.numpy()


def look_at_pushes(
    state: PushState[np.ndarray],
    goals: Float[np.ndarray, "row 7"],
    surface: Float32[np.ndarray, "row point 3"],
    pushes: Float[np.ndarray, "row push column"],
) -> PushView:
    """What a network sees of pushes; arguments as of :func:`judge`."""
    return view_pushes(state.to_tensors(), *(to_tensor(array) for array in (goals, surface, pushes)))
