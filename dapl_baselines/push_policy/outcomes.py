"""What a push is worth once it is over."""

from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Float64, Real
from pydantic import Field

from clutter6d.schema import FileModel
from dapl_baselines.push_policy.goal_potential import goal_potential


class Prices(FileModel):
    """What counts, beside the fall of the goal's price, which is 2.6 from start to success at the mean.

    Attributes:
        schema_version: Of these fields.
        discount: Of the future, for each control step.
        step: What a control step costs.
        success: What a success brings.
        drop: What a push brings that drops an object.
    """

    schema_version: Literal[1] = 1
    discount: float = Field(default=0.985, gt=0, le=1)
    step: float = Field(default=0.004, ge=0)
    success: float = Field(default=1.0, ge=0)
    drop: float = Field(default=-2.0, le=0)


def gains(
    before: Float[np.ndarray, "row 7"],
    after: Float[np.ndarray, "row 7"],
    goals: Float[np.ndarray, "row 7"],
    *,
    steps: Real[np.ndarray, "row"],
    is_success: Bool[np.ndarray, "row"],
    is_drop: Bool[np.ndarray, "row"],
    prices: Prices,
) -> Float64[np.ndarray, "row"]:
    """What each push brought: the fall of the goal's price, less its time, and the reward of how it ended.

    Args:
        before: The targets' poses before the pushes.
        after: Their poses after them.
        goals: Where they should go.
        steps: Control steps that the pushes took.
        is_success: Whether they ended at the goal.
        is_drop: Whether they ended with an object off the table.
        prices: What counts.
    """
    fall = goal_potential(before, goals) - goal_potential(after, goals)
    gain = fall - prices.step * steps + prices.success * is_success
    return np.where(is_drop & ~is_success, prices.drop, gain)


def future(
    value: Float[np.ndarray, "row"],
    *,
    steps: Real[np.ndarray, "row"],
    is_over: Bool[np.ndarray, "row"],
    prices: Prices,
) -> Float[np.ndarray, "row"]:
    """What the value of where pushes ended is worth when they begin; nothing where the episode is over."""
    return np.where(is_over, 0.0, prices.discount**steps * value)
