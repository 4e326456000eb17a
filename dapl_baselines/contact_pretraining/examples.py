"""Hands drawn near objects, and which patches of the objects they reach into (CORN's pretraining task)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import torch
from jaxtyping import Bool, Float32, Float64, Int
from torch import Tensor

from clutter6d.assets.asset import Asset
from clutter6d.geometry import quat_from_yaw, quat_multiply, quat_normalize, quat_to_matrix, rotation_6d
from clutter6d.sim.end_effector import end_effector_points, is_in_end_effector
from dapl_baselines.contact_pretraining.settings import ExampleSettings
from dapl_baselines.patches import cut_target

ORIENTATIONS: Final = 8
"""Stable orientations of an object that are drawn among, at most."""

_UPSIDE_DOWN: Final = np.array([0.0, 1.0, 0.0, 0.0])
"""Half a turn about the x axis."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ContactShapes:
    """Objects to touch.

    Attributes:
        surface: Their surface points, object frame; the farthest one at a distance of 1.
        orientations: Stable orientations (``wxyz``); those of objects that have fewer come again.
    """

    surface: Float32[np.ndarray, "asset 512 3"]
    orientations: Float64[np.ndarray, "asset 8 4"]

    @classmethod
    def of(cls, assets: Sequence[Asset]) -> "ContactShapes":
        """The shapes of assets."""
        surface = np.stack([asset.surface_points for asset in assets])
        farthest = np.linalg.norm(surface, axis=-1).max(axis=-1)
        return cls(
            surface=(surface / farthest[:, None, None]).astype(np.float32),
            orientations=np.stack([np.resize(asset.stable.quats_wxyz, (ORIENTATIONS, 4)) for asset in assets]),
        )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ContactExamples:
    """Objects, hands, and where they meet.

    Attributes:
        target: The objects' points as seen, with errors [m], world frame.
        patches: Points of each patch of them, its centre first.
        hand: The hands' positions [m] and 6-D rotations, world frame.
        is_touched: Whether a point of the patch truly lies in the hand.
    """

    target: Float32[Tensor, "row 512 3"]
    patches: Int[Tensor, "row 16 32"]
    hand: Float32[Tensor, "row 9"]
    is_touched: Bool[Tensor, "row 16"]

    def rows(self, chosen: Int[Tensor, "chosen"]) -> "ContactExamples":
        """Some of them."""
        return ContactExamples(
            target=self.target[chosen],
            patches=self.patches[chosen],
            hand=self.hand[chosen],
            is_touched=self.is_touched[chosen],
        )


def draw_examples(
    shapes: ContactShapes, settings: ExampleSettings, count: int, rng: np.random.Generator
) -> ContactExamples:
    """Objects standing above the table somewhere, and a hand near the surface of each.

    A random point of the hand is put beside a random point of the object, on the ray to it from the object's middle.

    Args:
        shapes: Which objects are drawn among.
        settings: How.
        count: How many.
        rng: Where all is drawn from.
    """
    true = _place_objects(shapes, settings, count, rng)
    quats, positions = _place_hands(true, settings, rng)
    in_hand = np.einsum("npi,nij->npj", true - positions[:, None], quat_to_matrix(quats))
    is_inside = is_in_end_effector(in_hand.reshape(-1, 3)).reshape(in_hand.shape[:2])
    target = torch.from_numpy((true + settings.noise_m * rng.normal(size=true.shape)).astype(np.float32))
    patches = cut_target(target)
    inside = torch.from_numpy(is_inside).gather(1, patches.flatten(1)).view_as(patches)
    hand = np.concatenate([positions, rotation_6d(quats)], axis=1).astype(np.float32)
    return ContactExamples(target=target, patches=patches, hand=torch.from_numpy(hand), is_touched=inside.any(dim=-1))


def _place_objects(
    shapes: ContactShapes, settings: ExampleSettings, count: int, rng: np.random.Generator
) -> Float64[np.ndarray, "row 512 3"]:
    """Points of objects of random sizes, at rest but for a height, turned about the vertical."""
    rows = rng.integers(len(shapes.surface), size=count)
    stable = shapes.orientations[rows, rng.integers(ORIENTATIONS, size=count)]
    turned = quat_multiply(quat_from_yaw(rng.uniform(-np.pi, np.pi, size=count)), stable)
    scales = rng.uniform(*settings.radius_m, size=count)
    points = np.einsum("nij,npj->npi", quat_to_matrix(turned), shapes.surface[rows]) * scales[:, None, None]
    points[..., 2] -= points[..., 2].min(axis=1, keepdims=True)
    reach = np.array(settings.place_m)
    return points + rng.uniform(reach * (-1, -1, 0), reach, size=(count, 3))[:, None]


def _place_hands(
    points: Float64[np.ndarray, "row 512 3"], settings: ExampleSettings, rng: np.random.Generator
) -> tuple[Float64[np.ndarray, "row 4"], Float64[np.ndarray, "row 3"]]:
    """Orientations and positions of hands that do not point upwards."""
    count, every = len(points), np.arange(len(points))
    quats = quat_normalize(rng.normal(size=(count, 4)))
    is_up = quat_to_matrix(quats)[:, 2, 2] > 0
    quats[is_up] = quat_multiply(_UPSIDE_DOWN, quats[is_up])
    touched = points[every, rng.integers(points.shape[1], size=count)]
    outward = touched - points.mean(axis=1)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True).clip(min=1e-9)
    gaps = settings.gap_mean_m + settings.gap_std_m * rng.normal(size=(count, 1))
    own = end_effector_points()[rng.integers(len(end_effector_points()), size=count)].astype(np.float64)
    reached = np.einsum("nij,nj->ni", quat_to_matrix(quats), own)
    return quats, touched + gaps * outward - reached
