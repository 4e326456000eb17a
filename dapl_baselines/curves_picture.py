"""Learning curves of trainings of policies, drawn: success on the validation scenes over hours and over steps."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from clutter6d.errors import InvalidFileError
from clutter6d.eval.metrics import wilson_interval
from clutter6d.schema import read_bytes

CURVE_FILE: Final = "validation.csv"
_COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Of the palette by Okabe and Ito, told apart by everyone."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Look:
    """One look at the validation scenes.

    Attributes:
        hours: Of training before it.
        steps: Control steps of all environments before it.
        success_rate: Share of episodes that ended at the goal.
        episodes: How many.
    """

    hours: float
    steps: int
    success_rate: float
    episodes: int

    @property
    def interval(self) -> tuple[float, float]:
        """The 95% Wilson interval of the success rate."""
        return wilson_interval(round(self.success_rate * self.episodes), self.episodes)


def read_looks(folder: Path) -> tuple[Look, ...]:
    """The looks of a training's folder.

    Raises:
        MissingFileError: There is no curve in it.
        InvalidFileError: It is damaged, or has no look yet.
    """
    path = folder / CURVE_FILE
    rows = list(csv.DictReader(read_bytes(path, what="validation curve").decode(errors="replace").splitlines()))
    if not rows:
        raise InvalidFileError(path, "holds no look at the validation scenes yet; train on")
    try:
        return tuple(_to_look(row) for row in rows)
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidFileError(path, f"not a validation curve ({type(error).__name__}: {error})") from None


def draw_curves(trainings: Mapping[str, Sequence[Look]]) -> bytes:
    """A PNG: success of each training with its interval, over hours beside over control steps.

    Args:
        trainings: Looks by name.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    panels: Any = figure.subplots(1, 2, sharey=True)
    for index, (name, looks) in enumerate(trainings.items()):
        colour = _COLOURS[index % len(_COLOURS)]
        places = [look.hours for look in looks], [look.steps / 1e6 for look in looks]
        rates = [100 * look.success_rate for look in looks]
        lows, highs = ([100 * look.interval[end] for look in looks] for end in (0, 1))
        for axes, at in zip(panels, places, strict=True):
            axes.plot(at, rates, color=colour, marker="o", linewidth=2, label=name)
            axes.fill_between(at, lows, highs, color=colour, alpha=0.15, linewidth=0)
    for axes, unit in zip(panels, ("hours of training", "million control steps"), strict=True):
        axes.set(xlabel=unit, xlim=(0, None), ylim=(0, None))
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(axis="y", alpha=0.3)
    panels[0].set_ylabel("success on validation episodes [%]")
    panels[0].legend(frameon=False, loc="upper left")
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=150, metadata={"Software": None})
    return buffer.getvalue()


def _to_look(row: Mapping[str, str]) -> Look:
    return Look(
        hours=float(row["timing_seconds"]) / 3600,
        steps=int(row["environment_steps"]),
        success_rate=float(row["success_rate"]),
        episodes=int(row["episodes"]),
    )
