"""Batches of transitions, made in the background; which ones depends on the seed and the step alone."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from jaxtyping import Float, Int
from pydantic import Field
from torch import Tensor

from clutter6d.schema import FileModel
from clutter6d.seeding import generator
from dapl_baselines.interactions.clouds import CloudPairs
from dapl_baselines.interactions.dataset import InteractionData, Transitions
from dapl_baselines.prefetching import prefetched


class BatchConfig(FileModel):
    """How batches are drawn.

    Attributes:
        schema_version: Of these fields.
        rows: Transitions of a batch.
        moving_share: Share of transitions in which an object moves. Of those recorded it is a quarter or less, and the
            others teach little that copying the input does not.
        is_turned: Whether each row's world is turned by a random angle about the vertical: physics does not know of
            north, and the same push is seen from every side.
    """

    schema_version: Literal[1] = 1
    rows: int = Field(default=64, ge=1, le=65_536)
    moving_share: float = Field(default=0.75, ge=0, le=1)
    is_turned: bool = True


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Batch:
    """Transitions as tensors; see :class:`~dapl_baselines.interactions.clouds.CloudPairs`."""

    now: Float[Tensor, "row 1280 7"]
    later: Float[Tensor, "row 1280 7"]
    flow: Float[Tensor, "row 3"]

    @classmethod
    def of(cls, pairs: CloudPairs) -> "Batch":
        """The same memory as tensors."""
        return cls(
            now=torch.from_numpy(pairs.now), later=torch.from_numpy(pairs.later), flow=torch.from_numpy(pairs.flow)
        )

    def to(self, device: torch.device) -> "Batch":
        """On a device."""
        return Batch(now=self.now.to(device), later=self.later.to(device), flow=self.flow.to(device))


def training_batch(data: InteractionData, step: int, config: BatchConfig, seed: int) -> Batch:
    """The batch of a step of training."""
    rng = generator(seed, "batch", step)
    chosen = data.training[draw_rows(data.training, config, rng)]
    yaw_rad = rng.uniform(-np.pi, np.pi, size=config.rows) if config.is_turned else None
    return Batch.of(data.clouds(chosen, yaw_rad=yaw_rad))


def draw_rows(transitions: Transitions, config: BatchConfig, rng: np.random.Generator) -> Int[np.ndarray, "row"]:
    """Rows of transitions, the moving share of them among those in which an object moves, if there are any."""
    moving, still = np.flatnonzero(transitions.is_moving), np.flatnonzero(~transitions.is_moving)
    count = round(config.moving_share * config.rows)
    if not len(moving) or not len(still):
        count = config.rows if len(moving) else 0
    parts = [rng.choice(moving, count)] if count else []
    parts += [rng.choice(still, config.rows - count)] if count < config.rows else []
    return np.concatenate(parts)


def in_order(data: InteractionData, transitions: Transitions, rows: int) -> Iterator[Batch]:
    """All of some transitions in batches; the last one may be smaller."""
    starts = range(0, len(transitions), rows)
    indices = np.arange(len(transitions))
    return prefetched(lambda start: Batch.of(data.clouds(transitions[indices[start : start + rows]])), starts)


def some_of(transitions: Transitions, count: int) -> Transitions:
    """So many transitions at most, drawn at random and always the same."""
    order = generator(0, "some_transitions").permutation(len(transitions))
    return transitions[np.sort(order[:count])]
