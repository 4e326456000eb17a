"""The pushes that a decision is made among: whole pushes, and near the target also segments from where the hand is.

Far from the target a segment does nothing, and a critic that must choose the best of many that do nothing chooses by
its own errors: it goes on choosing them.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float, Float64, Int

from clutter6d.geometry import quat_to_matrix
from dapl_baselines.push_policy.push_state import PushState
from dapl_baselines.push_policy.segments import draw_segments
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.push_policy.whole_pushes import draw_whole_pushes

NEAR_M: Final = 0.04
"""Finger tips nearer to a contact point than this are near the target."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Counts:
    """How many pushes of each kind are drawn.

    Attributes:
        segments: Segments, where the finger tips are near the target; elsewhere these are whole pushes too.
        whole: Whole pushes.
    """

    segments: int
    whole: int


def draw_candidates(
    state: PushState[np.ndarray],
    goals: Float[np.ndarray, "row 7"],
    shapes: TargetShapes,
    targets: Int[np.ndarray, "row"],
    counts: Counts,
    rng: np.random.Generator,
) -> Float64[np.ndarray, "row push column"]:
    """Pushes of each state, segments first.

    Args:
        state: The states.
        goals: Where the targets shall go.
        shapes: Shapes of targets.
        targets: Which shape each row's target has.
        counts: How many.
        rng: Where they are drawn from.
    """
    rotation = quat_to_matrix(state.poses[:, 3:].astype(np.float64)).transpose(0, 2, 1)
    points, normals = shapes.contacts[targets] @ rotation, shapes.normals[targets] @ rotation
    tips = (state.tips - state.poses[:, :3]).astype(np.float64)
    segments = draw_segments(points, normals, tips, state.hands, counts.segments, rng)
    drawn = draw_whole_pushes(state.poses, goals, points, normals, counts.segments + counts.whole, rng)
    is_near = (((points - tips[:, None]) ** 2).sum(axis=-1) < NEAR_M**2).any(axis=1)
    drawn[is_near, : counts.segments] = segments[is_near]
    return drawn
