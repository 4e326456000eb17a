"""Letting placed objects come to rest, and measuring whether they stay there."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from clutter6d.geometry import rotation_error_rad
from clutter6d.physics import PHYSICS_STEP_S
from clutter6d.sim.batch import SceneBatch


@dataclass(frozen=True, kw_only=True, slots=True)
class SettleConfig:
    """When objects count as at rest.

    Attributes:
        check_s: Time between two looks.
        limit_s: Time after which an object that still moves is given up.
        still_m: Displacement between two looks below which an object is at rest.
        still_rad: Rotation between two looks below which an object is at rest.
        hold_s: Time for which the stored state must hold (benchmark: 1 s).
    """

    check_s: float = 0.2
    limit_s: float = 2.0
    still_m: float = 5e-5
    still_rad: float = 5e-4
    hold_s: float = 1.0


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Drift:
    """Displacement [m] and rotation [rad] of every object of every slot."""

    distance_m: Float64[np.ndarray, "slot object"]
    angle_rad: Float64[np.ndarray, "slot object"]


def measure_drift(before: Float64[np.ndarray, "*n object 7"], after: Float64[np.ndarray, "*n object 7"]) -> Drift:
    """How far objects moved between two sets of poses."""
    return Drift(
        distance_m=np.linalg.norm(after[..., :3] - before[..., :3], axis=-1),
        angle_rad=rotation_error_rad(before[..., 3:], after[..., 3:]),
    )


def settle(batch: SceneBatch, config: SettleConfig) -> Bool[np.ndarray, "slot"]:
    """Step until every object of every slot is at rest, or the time is up; the poses stay in the batch.

    Each slot is frozen at its own first look at which it was still, so its result does not depend on the others.

    Returns:
        Which slots came to rest.
    """
    steps = round(config.check_s / PHYSICS_STEP_S)
    moving = np.arange(batch.size)
    for _ in range(round(config.limit_s / config.check_s)):
        before = batch.object_poses[moving].copy()
        batch.step(moving, physics_steps=steps)
        drift = measure_drift(before, batch.object_poses[moving])
        at_rest = ((drift.distance_m < config.still_m) & (drift.angle_rad < config.still_rad)).all(axis=1)
        moving = moving[~at_rest]
        if not len(moving):
            break
    settled = np.ones(batch.size, dtype=bool)
    settled[moving] = False
    settled[batch.unstable_slots()] = False
    return settled


def hold(batch: SceneBatch, poses: Float64[np.ndarray, "slot object 7"], config: SettleConfig) -> Drift:
    """Start every slot at rest from stored poses, simulate ``hold_s``, and report how far objects moved at most.

    The largest of four looks is reported, so that a swing there and back is seen too.
    """
    batch.reset(np.arange(batch.size), poses)
    distance, angle = np.zeros(poses.shape[:2]), np.zeros(poses.shape[:2])
    for _ in range(4):
        batch.step(physics_steps=round(config.hold_s / 4 / PHYSICS_STEP_S))
        drift = measure_drift(poses, batch.object_poses)
        distance, angle = np.maximum(distance, drift.distance_m), np.maximum(angle, drift.angle_rad)
    return Drift(distance_m=distance, angle_rad=angle)
