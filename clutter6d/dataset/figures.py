"""The figures of a collection of scenes: shares and medians for tables, distributions for plots and for comparing."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float64

from clutter6d.dataset.measurement import Measurements

Unit = Literal["", "count", "%", "cm", "mm", "deg", "kg"]
Group = Literal["difficulty", "clutter", "certificate"]
_FACTORS: dict[Unit, float] = {"": 1, "count": 1, "%": 100, "cm": 100, "mm": 1000, "deg": 180 / np.pi, "kg": 1}
_NO_DIFFERENCE = 5e-4


def show(value: float, unit: Unit, *, is_difference: bool = False) -> str:
    """A value in SI units (or a share) as it is printed, to three digits: ``0.03123`` in ``cm`` as ``3.12 cm``."""
    number, sign = _FACTORS[unit] * value, "+" if is_difference else ""
    if unit == "%":
        return f"{number:{sign}.1f} {'points' if is_difference else '%'}"
    if is_difference and abs(number) < _NO_DIFFERENCE:
        return "0"
    shown = f"{number:{sign},.0f}" if unit == "count" or abs(number) >= 1000 else f"{number:{sign}.3g}"
    return shown if unit in ("", "count") else f"{shown} {unit}"


@dataclass(frozen=True, kw_only=True, slots=True)
class Figure:
    """One number of a collection.

    Attributes:
        group: What it belongs to: difficulty, clutter, or certificate.
        label: What it says.
        unit: How it is printed.
        read: Computes it, in SI units or as a share.
    """

    group: Group
    label: str
    unit: Unit
    read: Callable[[Measurements], float]


@dataclass(frozen=True, kw_only=True, slots=True)
class Distribution:
    """One quantity with a value for each goal pair, object or scene.

    Attributes:
        label: What it is.
        unit: How it is printed.
        table: Which table of the measurements holds it.
        column: In which column.
        role: Only objects of this role; of all roles if empty.
    """

    label: str
    unit: Unit
    table: Literal["pairs", "objects", "scenes"]
    column: str
    role: Literal["", "target", "large", "small"] = ""

    def values(self, measured: Measurements) -> Float64[np.ndarray, "n"]:
        """All values of a collection, in SI units."""
        table = getattr(measured, self.table)
        rows = table[table["role"] == self.role] if self.role else table
        return rows[self.column].dropna().to_numpy(dtype=np.float64)

    def shown_values(self, measured: Measurements) -> Float64[np.ndarray, "n"]:
        """All values in the unit in which they are printed."""
        return _FACTORS[self.unit] * self.values(measured)

    @property
    def axis_label(self) -> str:
        """What a plot's axis says."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label


def _mean(table: Literal["pairs", "scenes"], column: str) -> Callable[[Measurements], float]:
    return lambda measured: float(getattr(measured, table)[column].mean())


def _worst(column: str) -> Callable[[Measurements], float]:
    return lambda measured: float(measured.scenes[column].max())


def _median(distribution: Distribution) -> Callable[[Measurements], float]:
    def read(measured: Measurements) -> float:
        values = distribution.values(measured)
        return float(np.median(values)) if len(values) else float("nan")

    return read


START_GAP = Distribution(label="gap, target at its start", unit="cm", table="pairs", column="start_gap_m")
GOAL_GAP = Distribution(label="gap, target at its goal", unit="cm", table="pairs", column="goal_gap_m")
OBSTACLE_GAP = Distribution(label="gap between obstacles", unit="cm", table="objects", column="gap_m")
COVERAGE = Distribution(label="clutter region covered", unit="%", table="scenes", column="covered_share")
BLOCKERS = Distribution(label="obstacles in the straight path", unit="", table="pairs", column="blockers")
DISPLACEMENT = Distribution(label="distance to the goal", unit="cm", table="pairs", column="displacement_m")
ROTATION = Distribution(label="rotation to the goal", unit="deg", table="pairs", column="rotation_rad")
TILT = Distribution(label="tilt to the goal", unit="deg", table="pairs", column="tilt_rad")
SYMMETRIC_TILT = Distribution(label="tilt, symmetry allowed", unit="deg", table="pairs", column="symmetric_tilt_rad")
MASS_RATIO = Distribution(label="mass of obstacle over target", unit="", table="objects", column="mass_ratio")
TARGET_MASS = Distribution(label="mass of the target", unit="kg", table="objects", column="mass_kg", role="target")
TARGET_SIZE = Distribution(
    label="longest side of the target", unit="cm", table="objects", column="longest_extent_m", role="target"
)

DISTRIBUTIONS = (
    START_GAP, GOAL_GAP, OBSTACLE_GAP, COVERAGE, BLOCKERS, DISPLACEMENT, ROTATION, TILT, SYMMETRIC_TILT,
    MASS_RATIO, TARGET_MASS, TARGET_SIZE,
)  # fmt: skip


def _shares(**columns: str) -> tuple[Figure, ...]:
    return tuple(
        Figure(group="difficulty", label=label, unit="%", read=_mean("pairs", column))
        for column, label in columns.items()
    )


def _medians(group: Group, *distributions: Distribution) -> tuple[Figure, ...]:
    return tuple(
        Figure(group=group, label=f"{item.label}, median", unit=item.unit, read=_median(item)) for item in distributions
    )


FIGURES: tuple[Figure, ...] = (
    *_shares(
        is_planar="planar",
        is_planar_symmetric="planar, symmetry allowed",
        is_face_changed="another resting face",
        is_face_changed_symmetric="another resting face, symmetry allowed",
        is_blocked="straight path blocked",
        is_blocked_by_large="blocked by a large obstacle",
        is_blocked_by_small="blocked by a small obstacle",
        is_easy="easy: planar and not blocked",
        is_easy_symmetric="easy, symmetry allowed",
        has_heavy_neighbour="heavier obstacle within 5 cm of the path",
    ),
    *_medians("difficulty", DISPLACEMENT, ROTATION),
    *_medians("clutter", START_GAP, GOAL_GAP, OBSTACLE_GAP),
    Figure(group="clutter", label=f"{BLOCKERS.label}, mean", unit="", read=_mean("pairs", "blockers")),
    Figure(group="clutter", label=f"{COVERAGE.label}, mean", unit="%", read=_mean("scenes", "covered_share")),
    *_medians("clutter", MASS_RATIO),
    Figure(group="certificate", label="deepest penetration", unit="mm", read=_worst("max_penetration_m")),
    Figure(group="certificate", label="largest drift in 1 s", unit="mm", read=_worst("max_drift_m")),
    Figure(group="certificate", label="largest turn in 1 s", unit="deg", read=_worst("max_drift_rad")),
)
"""What a card and a comparison tabulate."""
