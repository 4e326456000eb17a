"""Clouds shaped as observations give them: boxes' surfaces near the table, and a hand above."""

import numpy as np
import torch
from torch import Tensor

from clutter6d.seeding import generator


def make_clouds(rows: int, seed: int = 0) -> Tensor:
    """Clouds with real sizes, masses and velocities; no two distances are the same."""
    rng = generator(seed, "clouds")
    middles = np.array([[0.0, 0.0, 0.05], [0.15, 0.1, 0.08], [-0.1, 0.0, 0.2]])
    parts = []
    for middle, points in zip(middles, (512, 512, 256), strict=True):
        half = rng.uniform(0.03, 0.12, size=(rows, 1, 3))
        surface = rng.uniform(-1, 1, size=(rows, points, 3))
        face = rng.integers(3, size=(rows, points))
        np.put_along_axis(surface, face[..., None], np.sign(rng.normal(size=(rows, points, 1))), axis=2)
        mass = np.broadcast_to(rng.uniform(1e-4, 2e-3, size=(rows, 1, 1)), (rows, points, 1))
        velocity = np.broadcast_to(rng.normal(scale=0.05, size=(rows, 1, 3)), (rows, points, 3))
        # A little off the faces: on them many points would be equally far from a centre.
        positions = middle + half * surface + rng.normal(scale=1e-3, size=surface.shape)
        parts.append(np.concatenate([positions, mass, velocity], axis=2))
    return torch.from_numpy(np.concatenate(parts, axis=1).astype(np.float32))


def make_hands(rows: int, seed: int = 0) -> Tensor:
    """Hand states: above the table, any way round."""
    rng = generator(seed, "hands")
    columns = np.linalg.qr(rng.normal(size=(rows, 3, 3)))[0][:, :, :2]
    positions = rng.uniform([-0.3, -0.3, 0.05], [0.3, 0.3, 0.4], size=(rows, 3))
    rotation = np.swapaxes(columns, 1, 2).reshape(rows, 6)
    return torch.from_numpy(np.concatenate([positions, rotation], axis=1).astype(np.float32))


def make_step(rows: int, seed: int = 0) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Clouds, flows, and where and how the points move one step later."""
    cloud = make_clouds(rows, seed)
    rng = generator(seed, "step")
    flow = torch.from_numpy(rng.normal(scale=0.02, size=(rows, 3)).astype(np.float32))
    velocities = cloud[..., 4:] + torch.from_numpy(rng.normal(scale=0.03, size=(rows, 1, 3)).astype(np.float32))
    return cloud, flow, cloud[..., :3] + 0.1 * velocities, velocities
