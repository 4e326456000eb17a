"""Stable resting orientations: proposed by geometry, kept only if they hold in simulation.

trimesh proposes them from the hull of the convex parts; each is dropped from a millimetre on the benchmark's table,
settles, and must then hold for 1 s moving no more than 1 mm and 1 degree. What is stored is the settled orientation
and height.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
import trimesh
from jaxtyping import Bool, Float, Float64
from mujoco.batch import Batch

from clutter6d.assets.asset import MAX_STABLE_ORIENTATIONS, Asset, StableOrientations
from clutter6d.assets.mujoco_body import add_asset_body
from clutter6d.errors import MeshRejectedError
from clutter6d.geometry import quat_conjugate, quat_normalize, rotate, rotation_error_rad
from clutter6d.physics import PHYSICS_STEP_S, add_table, apply_physics_options
from clutter6d.seeding import generator

_DECIMALS = 9
"""Proposals are rounded to so many: what differs between processors is a million times smaller."""


@dataclass(frozen=True, kw_only=True, slots=True)
class StablePoseSettings:
    """How orientations are proposed and verified.

    Attributes:
        max_orientations: Those kept, most probable first.
        min_probability: Share of random drops below which an orientation is not tried.
        drop_height_m: Gap under the object at the start.
        settle_s: Longest time to come to rest.
        hold_s: Time for which the pose must hold.
        max_shift_m: Largest movement while it holds.
        max_turn_rad: Largest rotation while it holds.
        same_rad: Orientations closer than this, whatever their yaw, are one.
        random_drops: Random orientations that are dropped where geometry proposes none that holds.
    """

    max_orientations: int = MAX_STABLE_ORIENTATIONS
    min_probability: float = 0.005
    drop_height_m: float = 0.001
    settle_s: float = 2.0
    hold_s: float = 1.0
    max_shift_m: float = 0.001
    max_turn_rad: float = float(np.deg2rad(1.0))
    same_rad: float = float(np.deg2rad(4.0))
    random_drops: int = 32


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StablePoseReport:
    """Orientations that held, how many were proposed, and what did not go the normal way."""

    stable: StableOrientations
    candidates: int
    fallbacks: tuple[str, ...]


def find_stable_orientations(asset: Asset, settings: StablePoseSettings) -> StablePoseReport:
    """Resting orientations of an asset, most probable first; the asset's own ``stable`` is not read.

    Raises:
        MeshRejectedError: It comes to rest in none.
    """
    vertices = np.concatenate([part.vertices for part in asset.parts]).astype(np.float64)
    quats, probabilities, fallbacks = propose_orientations(vertices, settings)
    poses, held = drop_test(asset, quats, vertices, settings)
    candidates = len(quats)
    if not held.any():
        rng = generator(0, "random-drops")
        quats = quat_normalize(rng.normal(size=(settings.random_drops, 4)))
        probabilities = np.full(len(quats), 1 / len(quats))
        poses, held = drop_test(asset, quats, vertices, settings)
        candidates, fallbacks = candidates + len(quats), (*fallbacks, "stable-poses:random-drops")
    if not held.any():
        raise MeshRejectedError("unstable", f"comes to rest in none of {candidates} orientations")
    stable = _merge(poses[held], probabilities[held], settings)
    return StablePoseReport(stable=stable, candidates=candidates, fallbacks=fallbacks)


def propose_orientations(
    vertices: Float[np.ndarray, "vertex 3"], settings: StablePoseSettings
) -> tuple[Float64[np.ndarray, "pose 4"], Float64[np.ndarray, "pose"], tuple[str, ...]]:
    """Orientations in which the convex hull rests, with the centre of mass at the origin.

    trimesh looks for a sampled centre of mass inside the hull and would look for ever if there is none; the hull's
    own takes its place then.
    """
    hull = trimesh.convex.convex_hull(vertices)
    heights = (hull.triangles_center * hull.face_normals).sum(axis=1)
    is_inside = bool((heights > 1e-6).all())
    centre = np.zeros(3) if is_inside else np.asarray(hull.center_mass)
    fallbacks = () if is_inside else ("stable-poses:hull-centre",)
    try:
        with np.errstate(all="ignore"):
            transforms, probabilities = trimesh.poses.compute_stable_poses(
                hull, center_mass=centre, sigma=0.0, n_samples=1, threshold=settings.min_probability, seed=0
            )
    except (ValueError, IndexError, KeyError, ZeroDivisionError):
        transforms, probabilities = np.zeros((0, 4, 4)), np.zeros(0)
    if not len(transforms):
        return np.zeros((0, 4)), np.zeros(0), (*fallbacks, "stable-poses:none-proposed")
    is_proper = np.isfinite(transforms).all(axis=(1, 2)) & np.isfinite(probabilities)
    ups = np.round(np.asarray(transforms)[is_proper, 2, :3], _DECIMALS) + 0.0
    shares = np.round(np.asarray(probabilities, dtype=np.float64)[is_proper], _DECIMALS)
    order = np.lexsort((*ups.T, -shares))[: settings.max_orientations]
    return upright(ups[order]), shares[order], fallbacks


def upright(ups: Float64[np.ndarray, "pose 3"]) -> Float64[np.ndarray, "pose 4"]:
    """The smallest rotation that brings each direction to the vertical.

    It depends on the direction alone: the yaw that trimesh's decompositions happen to give differs between processors.
    """
    x, y, z = ups.T
    quats = np.stack([1 + z, y, -x, np.zeros_like(z)], axis=1)
    quats[z < -1 + 10**-_DECIMALS] = (0.0, 1.0, 0.0, 0.0)
    return quat_normalize(quats)


def drop_test(
    asset: Asset,
    quats: Float64[np.ndarray, "pose 4"],
    vertices: Float[np.ndarray, "vertex 3"],
    settings: StablePoseSettings,
) -> tuple[Float64[np.ndarray, "pose 7"], Bool[np.ndarray, "pose"]]:
    """Settle each orientation on the table and see whether it then holds.

    Returns:
        Settled poses, and which of them held.
    """
    if not len(quats):
        return np.zeros((0, 7)), np.zeros(0, dtype=bool)
    spec = mujoco.MjSpec()
    apply_physics_options(spec)
    add_table(spec, (4.0, 4.0))
    add_asset_body(spec, asset, name="object")
    batch = Batch(spec.compile(), len(quats), 1)
    qpos = batch.bind("qpos")
    lowest = rotate(quats[:, None], vertices[None])[..., 2].min(axis=1)
    qpos[:, :2] = 0
    qpos[:, 2] = settings.drop_height_m - lowest
    qpos[:, 3:] = quats
    _settle(batch, settings)
    settled = qpos.copy()
    settled[:, :2], settled[:, 3:] = 0, quat_normalize(settled[:, 3:])
    return settled, _holds(batch, settled, settings)


def _settle(batch: Batch, settings: StablePoseSettings) -> None:
    """Step until all are at rest or the time is up."""
    qpos, moving, chunk = batch.bind("qpos"), np.arange(batch.nsim), 20
    for _ in range(round(settings.settle_s / PHYSICS_STEP_S / chunk)):
        before = qpos[moving].copy()
        batch.step(moving, nstep=chunk)
        shift = np.linalg.norm(qpos[moving, :3] - before[:, :3], axis=1)
        turn = rotation_error_rad(quat_normalize(before[:, 3:]), quat_normalize(qpos[moving, 3:]))
        moving = moving[(shift > 2e-5) | (turn > 2e-4)]
        if not len(moving):
            return


def _holds(
    batch: Batch, settled: Float64[np.ndarray, "pose 7"], settings: StablePoseSettings
) -> Bool[np.ndarray, "pose"]:
    """Start at rest from the settled poses and look ten times."""
    batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
    qpos = batch.bind("qpos")
    qpos[:] = settled
    held = np.isfinite(settled).all(axis=1)
    for _ in range(10):
        alive = np.flatnonzero(held)
        if not len(alive):
            break
        batch.step(alive, nstep=round(settings.hold_s / PHYSICS_STEP_S / 10))
        shift = np.linalg.norm(qpos[:, :3] - settled[:, :3], axis=1)
        turn = rotation_error_rad(quat_normalize(qpos[:, 3:]), settled[:, 3:])
        held &= (shift <= settings.max_shift_m) & (turn <= settings.max_turn_rad)
    return held & (settled[:, 2] > 0)


def _merge(
    poses: Float64[np.ndarray, "pose 7"], probabilities: Float64[np.ndarray, "pose"], settings: StablePoseSettings
) -> StableOrientations:
    """One of each group that differs in yaw alone, with the group's probability."""
    ups = rotate(quat_conjugate(poses[:, 3:]), np.array([0.0, 0.0, 1.0]))
    kept: list[int] = []
    shares: list[float] = []
    for index in np.argsort(-probabilities, kind="stable"):
        angles = [float(np.arccos(np.clip(ups[index] @ ups[other], -1, 1))) for other in kept]
        if angles and min(angles) < settings.same_rad:
            shares[int(np.argmin(angles))] += float(probabilities[index])
        else:
            kept.append(int(index))
            shares.append(float(probabilities[index]))
    order = np.argsort(-np.array(shares), kind="stable")[: settings.max_orientations]
    share, rows = np.array(shares)[order], poses[np.array(kept)[order]]
    return StableOrientations(
        quats_wxyz=rows[:, 3:].copy(), heights_m=rows[:, 2].copy(), probabilities=share / share.sum()
    )
