"""Telling two data sets apart: the same figures side by side, how far distributions lie apart, what they share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from clutter6d.dataset.figures import DISTRIBUTIONS, FIGURES, Distribution, Figure
from clutter6d.dataset.measurement import Measurements


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class MeasuredSplit:
    """One split, as far as comparing goes.

    Attributes:
        sha256: Hash of its scenes.
        asset_hashes: Content hashes of the assets in its scenes.
        measured: What was measured of its scenes.
    """

    sha256: str
    asset_hashes: frozenset[str]
    measured: Measurements


@dataclass(frozen=True, kw_only=True, slots=True)
class FigureDifference:
    """One figure of two splits, in SI units or as a share."""

    figure: Figure
    first: float
    second: float

    @property
    def difference(self) -> float:
        """Second minus first."""
        return self.second - self.first


@dataclass(frozen=True, kw_only=True, slots=True)
class DistributionDistance:
    """How far two samples of one quantity lie apart.

    Attributes:
        distribution: The quantity.
        distance: Kolmogorov-Smirnov statistic: the largest difference of the two shares up to any value, in [0, 1].
        first_count: Values of the first sample.
        second_count: Values of the second.
    """

    distribution: Distribution
    distance: float
    first_count: int
    second_count: int


@dataclass(frozen=True, kw_only=True, slots=True)
class SplitComparison:
    """Two splits side by side.

    Attributes:
        first_name: Name of the first.
        second_name: Name of the second.
        is_identical: Whether their hashes agree: the same scenes to the bit.
        shared_assets: Assets in scenes of both, by content hash.
        first_assets: Assets in scenes of the first.
        second_assets: Assets in scenes of the second.
        figures: All figures.
        distances: All distributions.
    """

    first_name: str
    second_name: str
    is_identical: bool
    shared_assets: int
    first_assets: int
    second_assets: int
    figures: tuple[FigureDifference, ...]
    distances: tuple[DistributionDistance, ...]


@dataclass(frozen=True, kw_only=True, slots=True)
class Comparison:
    """Two data sets side by side.

    Attributes:
        splits: The splits that both have.
        only_first: Names of the splits that only the first has.
        only_second: Names of those that only the second has.
    """

    splits: tuple[SplitComparison, ...]
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]

    @property
    def is_identical(self) -> bool:
        """Whether both have the same splits to the bit."""
        return not self.only_first and not self.only_second and all(split.is_identical for split in self.splits)


def pair_splits(first: Sequence[str], second: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Which splits to compare: those of one name; or the only two there are, whatever their names."""
    if len(first) == len(second) == 1:
        return ((first[0], second[0]),)
    return tuple((name, name) for name in first if name in second)


def compare_datasets(first: Mapping[str, MeasuredSplit], second: Mapping[str, MeasuredSplit]) -> Comparison:
    """Compare the splits of two data sets.

    Args:
        first: The splits of the first by name.
        second: Those of the second.
    """
    pairs = pair_splits(tuple(first), tuple(second))
    return Comparison(
        splits=tuple(compare_splits(a, first[a], b, second[b]) for a, b in pairs),
        only_first=tuple(name for name in first if name not in [a for a, _ in pairs]),
        only_second=tuple(name for name in second if name not in [b for _, b in pairs]),
    )


def compare_splits(first_name: str, first: MeasuredSplit, second_name: str, second: MeasuredSplit) -> SplitComparison:
    """Compare two splits, figure by figure."""
    return SplitComparison(
        first_name=first_name,
        second_name=second_name,
        is_identical=first.sha256 == second.sha256,
        shared_assets=len(first.asset_hashes & second.asset_hashes),
        first_assets=len(first.asset_hashes),
        second_assets=len(second.asset_hashes),
        figures=tuple(
            FigureDifference(figure=figure, first=figure.read(first.measured), second=figure.read(second.measured))
            for figure in FIGURES
        ),
        distances=tuple(_distance(item, first.measured, second.measured) for item in DISTRIBUTIONS),
    )


def _distance(distribution: Distribution, first: Measurements, second: Measurements) -> DistributionDistance:
    a, b = distribution.values(first), distribution.values(second)
    return DistributionDistance(
        distribution=distribution, distance=ks_distance(a, b), first_count=len(a), second_count=len(b)
    )


def ks_distance(first: Float64[np.ndarray, "n"], second: Float64[np.ndarray, "m"]) -> float:
    """Kolmogorov-Smirnov distance of two samples: 0 if their distributions agree, 1 if they do not overlap.

    It is a distance, not a test: the goal pairs of one scene are no independent draws. NaN if a sample is empty.
    """
    if not len(first) or not len(second):
        return float("nan")
    points = np.concatenate([first, second])
    shares = [np.searchsorted(np.sort(sample), points, side="right") / len(sample) for sample in (first, second)]
    return float(np.abs(shares[0] - shares[1]).max())
