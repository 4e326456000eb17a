"""The plots of a data card: quiet, and on paper of their own, so that they read on light pages and on dark ones."""

import importlib
from collections.abc import Callable, Mapping, Sequence
from io import BytesIO
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd

from clutter6d.dataset.figures import COVERAGE, DISPLACEMENT, OBSTACLE_GAP, ROTATION, START_GAP, TILT, Distribution
from clutter6d.dataset.measurement import Measurements
from clutter6d.errors import MissingDependencyError

_COLOURS = ("#9aa5b1", "#5fb49c", "#3a7ca5", "#5b2a86", "#d98e04", "#c44536")
_STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#6b7280",
    "axes.labelcolor": "#374151",
    "axes.titlecolor": "#374151",
    "xtick.color": "#6b7280",
    "ytick.color": "#6b7280",
    "text.color": "#374151",
    "figure.facecolor": "#fbfbfa",
    "axes.facecolor": "#fbfbfa",
    "legend.frameon": False,
}
_DOTS_PER_INCH = 110
_KINDS_OF_GOAL = (
    ("slide, free path", "#cfe3d4", True, False),
    ("slide, blocked path", "#8fbf9f", True, True),
    ("other face, free path", "#b9c8e0", False, False),
    ("other face, blocked path", "#4a6fa5", False, True),
)


def plot_difficulty(measured: Mapping[str, Measurements]) -> bytes:
    """What it takes to reach a goal: for each split, the shares of the four kinds of goal, as a PNG."""

    def draw(figure: Any) -> None:
        axes = figure.subplots()
        names, left = list(measured), np.zeros(len(measured))
        for label, colour, is_planar, is_blocked in _KINDS_OF_GOAL:
            pairs = [item.pairs for item in measured.values()]
            rows = [(item["is_planar"] == is_planar) & (item["is_blocked"] == is_blocked) for item in pairs]
            shares = np.array([100 * float(row.mean()) for row in rows])
            axes.barh(names, shares, left=left, color=colour, label=label, height=0.62)
            for y, (share, start) in enumerate(zip(shares, left, strict=True)):
                if share >= 3:
                    ink = "white" if colour == _KINDS_OF_GOAL[-1][1] else "#374151"
                    axes.text(start + share / 2, y, f"{share:.0f}", ha="center", va="center", color=ink)
            left += shares
        axes.invert_yaxis()
        axes.set(xlim=(0, 100), xlabel="share of goals [%]")
        figure.legend(loc="outside upper center", ncols=len(_KINDS_OF_GOAL), fontsize=8)

    return _render(draw, (8.0, 1.2 + 0.38 * len(measured)))


def plot_clutter(measured: Mapping[str, Measurements]) -> bytes:
    """How full the table is: gaps and coverage, as a PNG."""
    return _plot_shares(measured, ((START_GAP, 25), (OBSTACLE_GAP, 25), (COVERAGE, 60)))


def plot_goals(measured: Mapping[str, Measurements]) -> bytes:
    """How far the goals are: distances, rotations and tilts, as a PNG."""
    return _plot_shares(measured, ((DISPLACEMENT, 70), (ROTATION, 180), (TILT, 180)))


def _plot_shares(measured: Mapping[str, Measurements], panels: Sequence[tuple[Distribution, float]]) -> bytes:
    """For each quantity, the share of values up to x; one line a split."""

    def draw(figure: Any) -> None:
        for axes, (distribution, limit) in zip(
            np.ravel(figure.subplots(1, len(panels), sharey=True)), panels, strict=True
        ):
            for (name, item), colour in zip(measured.items(), _colours(len(measured)), strict=True):
                values = np.sort(distribution.shown_values(item))
                axes.plot(values, 100 * np.arange(1, len(values) + 1) / len(values), label=name, color=colour)
            axes.set(xlim=(0, limit), ylim=(0, 100), xlabel=fill(distribution.axis_label, 30))
            axes.grid(color="#e5e7eb", linewidth=0.6)
        figure.axes[0].set_ylabel("share up to this [%]")
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=6, fontsize=8)

    return _render(draw, (8.0, 2.9))


def plot_assets(assets: pd.DataFrame) -> bytes:
    """Sizes, masses, convex parts and resting orientations of the assets of each pool, as a PNG."""
    masses = np.geomspace(*_span(assets["mass_kg"]), 24)
    panels = (
        ("longest side [cm]", 100 * assets["longest_extent_m"], np.arange(5, 37.5, 1.25)),
        ("mass [kg]", assets["mass_kg"], masses),
        ("convex parts", assets["parts"], _counts(assets["parts"])),
        ("stable orientations", assets["stable_orientations"], _counts(assets["stable_orientations"])),
    )

    def draw(figure: Any) -> None:
        pools = sorted(assets["pool"].unique(), reverse=True)
        for axes, (label, values, bins) in zip(np.ravel(figure.subplots(1, len(panels))), panels, strict=True):
            for pool, colour in zip(pools, _colours(len(pools)), strict=True):
                chosen = values[assets["pool"] == pool]
                weights = np.full(len(chosen), 100 / max(len(chosen), 1))
                axes.hist(chosen, bins=bins, weights=weights, label=pool, color=colour, histtype="step", linewidth=1.4)
            axes.set(xlabel=label, xscale="log" if label.startswith("mass") else "linear")
        figure.axes[0].set_ylabel("share of assets [%]")
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=6, fontsize=8)

    return _render(draw, (8.0, 2.6))


def _span(values: pd.Series) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    return low * 0.95, high * 1.05


def _counts(values: pd.Series) -> np.ndarray:
    step = max(1, round(float(values.max()) / 20))
    return np.arange(0.5, float(values.max()) + step + 0.5, step)


def _colours(count: int) -> list[str]:
    return [_COLOURS[index % len(_COLOURS)] for index in range(count)]


def check_matplotlib() -> None:
    """See that plots can be drawn.

    Raises:
        MissingDependencyError: matplotlib is not installed.
    """
    try:
        importlib.import_module("matplotlib.figure")
    except ImportError:
        raise MissingDependencyError(
            'a data card needs matplotlib, which is not installed; run: pip install "clutter6d[card]"'
        ) from None


def _render(draw: Callable[[Any], None], size_inch: tuple[float, float]) -> bytes:
    """A figure as PNG; equal input gives equal bytes with one version of matplotlib."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    buffer = BytesIO()
    with rc_context(_STYLE):
        figure = Figure(figsize=size_inch, layout="constrained")
        draw(figure)
        figure.savefig(buffer, format="png", dpi=_DOTS_PER_INCH, metadata={"Software": None})
    return buffer.getvalue()
