"""Drawing segments: short straight movements from where the hand is, mostly against what it touches."""

from typing import Final

import numpy as np
from jaxtyping import Float, Float64

from dapl_baselines.push_policy import push as columns

LENGTH_M: Final = (0.015, 0.08)
SPEED_M: Final = (0.010, 0.025)
TOWARDS_SHARE: Final = 0.4
AGAINST_SHARE: Final = 0.3
"""Shares of segments towards the nearest contact, and against the surface there, up or down; the rest go anywhere."""
NEAREST_M: Final = 0.005


def draw_segments(
    points: Float64[np.ndarray, "row point 3"],
    normals: Float64[np.ndarray, "row point 3"],
    tips: Float64[np.ndarray, "row 3"],
    hands: Float[np.ndarray, "row 4"],
    count: int,
    rng: np.random.Generator,
) -> Float64[np.ndarray, "row push column"]:
    """Segments of each state; contact and normal are those of the contact point nearest to the tips.

    Args:
        points: Contact points of the targets, in world axes, from their origins [m].
        normals: Outward unit normals there, in world axes.
        tips: Where the finger tips are, from the targets' origins [m].
        hands: How the hands are held, see :data:`dapl_baselines.push_policy.push.HAND`.
        count: Segments of a state.
        rng: Where they are drawn from.
    """
    rows, shape = np.arange(len(points)), (len(points), count)
    nearest = ((points - tips[:, None]) ** 2).sum(axis=-1).argmin(axis=1)
    contact, normal = points[rows, nearest][:, None], normals[rows, nearest][:, None]
    way = contact - tips[:, None]
    towards = way / np.maximum(np.sqrt((way**2).sum(axis=-1, keepdims=True)), NEAREST_M)
    kind, anywhere = rng.random((*shape, 1)), rng.normal(size=(*shape, 3)) * [1.0, 1.0, 0.5]
    lift = rng.normal(size=(*shape, 1)) * [0.0, 0.0, 0.8]
    against = np.where(kind < TOWARDS_SHARE + AGAINST_SHARE, lift - normal + 0.3 * anywhere, anywhere)
    direction = np.where(kind < TOWARDS_SHARE, 0.6 * (towards - normal) + 0.5 * anywhere, against)
    segments = np.zeros((*shape, columns.SIZE))
    segments[..., columns.CONTACT], segments[..., columns.NORMAL] = contact, normal
    length = np.sqrt((direction**2).sum(axis=-1, keepdims=True))
    segments[..., columns.DIRECTION] = direction / np.maximum(length, 1e-6)
    segments[..., columns.START], segments[..., columns.HAND] = tips[:, None], hands[:, None]
    segments[..., columns.LENGTH] = rng.uniform(*LENGTH_M, shape)
    segments[..., columns.SPEED] = rng.uniform(*SPEED_M, shape)
    segments[..., columns.IS_SEGMENT] = 1.0
    return segments
