"""Pushes judged by a critic, from arrays to arrays."""

from collections.abc import Callable
from typing import Final

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Float64, Int

from dapl_baselines.push_policy.critic import Judgement
from dapl_baselines.push_policy.push_frame import PushView, view_pushes
from dapl_baselines.push_policy.push_state import PushState, to_tensor

Critic = Callable[[PushView], Judgement]
MayBegin = Callable[[Float64[np.ndarray, "push column"]], Bool[np.ndarray, "push"]]
"""Tells which of some pushes can begin; of pushes of several states, one of each in order."""
TRIES: Final = 16
"""Of so many best pushes of a state it is asked whether they can begin."""


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


def choose(
    values: Float32[np.ndarray, "row push"],
    pushes: Float64[np.ndarray, "row push column"],
    may_begin: MayBegin,
) -> Int[np.ndarray, "row"]:
    """The best push of each state that can begin; if none of the best few can, one that cannot.

    Args:
        values: What each push is worth.
        pushes: What is chosen among.
        may_begin: Which of some pushes, one of each state, can begin.
    """
    rows, left, chosen = np.arange(len(values)), values.copy(), values.argmax(axis=1)
    for _ in range(min(TRIES, values.shape[1]) - 1):
        cannot = ~may_begin(pushes[rows, chosen])
        if not cannot.any():
            break
        left[cannot, chosen[cannot]] = -np.inf
        chosen = left.argmax(axis=1)
    return chosen


def look_at_pushes(
    state: PushState[np.ndarray],
    goals: Float[np.ndarray, "row 7"],
    surface: Float32[np.ndarray, "row point 3"],
    pushes: Float[np.ndarray, "row push column"],
) -> PushView:
    """What a network sees of pushes; arguments as of :func:`judge`."""
    return view_pushes(state.to_tensors(), *(to_tensor(array) for array in (goals, surface, pushes)))
