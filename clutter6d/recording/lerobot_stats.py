"""Statistics of a LeRobot data set's features, by episode and joined: what ``meta/stats.json`` holds."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Literal

import numpy as np
from jaxtyping import Int64, UInt8

from clutter6d.schema import FileModel

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
_LEVELS = 256
Values = tuple[float, ...]


class FeatureStats(FileModel):
    """Statistics of one feature, a number for each component; a picture's components are its colours, in [0, 1].

    Attributes:
        count: Frames.
        min: Smallest value.
        max: Largest value.
        mean: Mean.
        std: Standard deviation (of the population).
        q01: Quantile; the smallest value that so large a share of the values does not exceed.
        q10: Likewise.
        q50: Likewise.
        q90: Likewise.
        q99: Likewise.
    """

    count: int
    min: Values
    max: Values
    mean: Values
    std: Values
    q01: Values
    q10: Values
    q50: Values
    q90: Values
    q99: Values


class EpisodeStats(FileModel):
    """Statistics of one episode's features, by name."""

    schema_version: Literal[1] = 1
    features: dict[str, FeatureStats]


STATISTICS = tuple(name for name in FeatureStats.model_fields if name != "count")


def array_stats(array: np.ndarray) -> FeatureStats:
    """Statistics of frames, for each component of the last axis."""
    rows = array.reshape(-1, array.shape[-1] if array.ndim > 1 else 1).astype(np.float64)
    quantiles = np.quantile(rows, list(QUANTILES.values()), axis=0, method="inverted_cdf")
    values = dict(zip(QUANTILES, quantiles, strict=True))
    values |= {"min": rows.min(axis=0), "max": rows.max(axis=0), "mean": rows.mean(axis=0), "std": rows.std(axis=0)}
    return FeatureStats(count=len(array), **{name: tuple(value.tolist()) for name, value in values.items()})


class ColourCounter:
    """Counts the colour values of pictures that pass through; their statistics are exact."""

    def __init__(self) -> None:
        self._counts: Int64[np.ndarray, "3 level"] = np.zeros((3, _LEVELS), dtype=np.int64)
        self._frames = 0

    def watch(self, frames: Iterable[UInt8[np.ndarray, "_ _ 3"]]) -> Iterator[UInt8[np.ndarray, "_ _ 3"]]:
        """Count, and hand on."""
        for frame in frames:
            self._frames += 1
            for colour in range(3):
                self._counts[colour] += np.bincount(frame[..., colour].reshape(-1), minlength=_LEVELS)
            yield frame

    def stats(self) -> FeatureStats:
        """Statistics of what was counted."""
        levels = np.arange(_LEVELS) / (_LEVELS - 1)
        total = self._counts.sum(axis=1)
        below = np.cumsum(self._counts, axis=1)
        mean = self._counts @ levels / total
        values = {name: _level(below, np.maximum(np.ceil(q * total), 1)) for name, q in QUANTILES.items()}
        values |= {"min": _level(below, np.ones(3)), "max": _level(below, total)}
        values |= {"mean": mean, "std": np.sqrt(np.maximum(self._counts @ levels**2 / total - mean**2, 0))}
        return FeatureStats(count=self._frames, **{name: tuple(value.tolist()) for name, value in values.items()})


def join_stats(parts: Sequence[FeatureStats]) -> FeatureStats:
    """Statistics of several episodes together; exact but for quantiles, whose weighted means LeRobot takes as well."""
    counts = np.array([part.count for part in parts], dtype=np.float64)
    columns = {name: np.array([getattr(part, name) for part in parts]) for name in STATISTICS}
    values = {name: np.average(columns[name], axis=0, weights=counts) for name in ("mean", *QUANTILES)}
    spread = columns["std"] ** 2 + (columns["mean"] - values["mean"]) ** 2
    values |= {"min": columns["min"].min(axis=0), "max": columns["max"].max(axis=0)}
    values["std"] = np.sqrt(np.average(spread, axis=0, weights=counts))
    return FeatureStats(count=int(counts.sum()), **{name: tuple(value.tolist()) for name, value in values.items()})


def to_lists(stats: FeatureStats, *, is_picture: bool) -> dict[str, list[object]]:
    """Statistics as LeRobot writes them: numbers in a list; a picture's in the shape of 3 x 1 x 1."""
    lists: dict[str, list[object]] = {
        name: [[[value]] if is_picture else value for value in getattr(stats, name)] for name in STATISTICS
    }
    lists["count"] = [stats.count]
    return lists


def _level(below: Int64[np.ndarray, "3 level"], wanted: np.ndarray) -> np.ndarray:
    """The smallest level of each colour that so many values do not exceed, in [0, 1]."""
    return np.array([np.searchsorted(counts, want) for counts, want in zip(below, wanted, strict=True)]) / (_LEVELS - 1)
