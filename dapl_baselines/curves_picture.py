"""Learning curves of trainings of policies, drawn: success over hours and over steps.

What is practised is drawn as well: it is easier or harder than what is looked at (policies explore, teachers help), but
of many more episodes.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from clutter6d.errors import InvalidFileError
from clutter6d.eval.metrics import wilson_interval
from clutter6d.schema import read_bytes

LOOKS_FILE: Final = "validation.csv"
PRACTICE_FILE: Final = "training.csv"
PRACTICE_POINTS: Final = 20
"""Points of the curve of what is practised, each the mean over as many iterations."""
MIN_EPISODES: Final = 10
"""Fewer say nothing."""
_COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Of the palette by Okabe and Ito, told apart by everyone."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Look:
    """How a policy did at some time of its training.

    Attributes:
        hours: Of training before.
        steps: Control steps of all environments before.
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


@dataclass(frozen=True, kw_only=True, slots=True)
class Course:
    """The curves of a training.

    Attributes:
        looks: At the validation scenes.
        practice: What was practised, in parts of equally many iterations.
    """

    looks: tuple[Look, ...]
    practice: tuple[Look, ...]


def read_course(folder: Path) -> Course:
    """The curves in a training's folder.

    Raises:
        MissingFileError: There is none.
        InvalidFileError: One is damaged, or there was no look yet.
    """
    looks, practice = _read(folder / LOOKS_FILE), _read(folder / PRACTICE_FILE)
    if not looks:
        raise InvalidFileError(folder / LOOKS_FILE, "holds no look at the validation scenes yet; train on")
    size = max(1, -(-len(practice) // PRACTICE_POINTS))
    parts = [practice[first : first + size] for first in range(0, len(practice), size)]
    enough = [part for part in parts if sum(look.episodes for look in part) >= MIN_EPISODES]
    return Course(looks=looks, practice=tuple(_joined(part) for part in enough))


def draw_curves(trainings: Mapping[str, Course]) -> bytes:
    """A PNG: success of each training with its interval, over hours beside over control steps.

    Args:
        trainings: Curves by name.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 3.4), layout="constrained")
    panels: Any = figure.subplots(1, 2, sharey=True)
    for index, (name, course) in enumerate(trainings.items()):
        colour = _COLOURS[index % len(_COLOURS)]
        rates = [100 * look.success_rate for look in course.looks]
        ends = [[abs(100 * look.interval[end] - 100 * look.success_rate) for look in course.looks] for end in (0, 1)]
        practised = [100 * look.success_rate for look in course.practice]
        places = zip(_places(course.looks), _places(course.practice), strict=True)
        for axes, (at, practised_at) in zip(panels, places, strict=True):
            style = {"color": colour, "marker": "o", "linewidth": 2, "elinewidth": 1, "capsize": 3}
            axes.errorbar(at, rates, yerr=ends, label=f"{name}, held-out scenes", **style)
            axes.plot(practised_at, practised, color=colour, linewidth=1.2, linestyle="--", label=f"{name}, practising")
    for axes, unit in zip(panels, ("hours of training", "million control steps"), strict=True):
        axes.set(xlabel=unit, xlim=(0, None), ylim=(0, None))
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(axis="y", alpha=0.3)
    panels[0].set_ylabel("success [%]")
    panels[1].legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=150, metadata={"Software": None})
    return buffer.getvalue()


def _places(looks: Sequence[Look]) -> tuple[list[float], list[float]]:
    return [look.hours for look in looks], [look.steps / 1e6 for look in looks]


def _joined(looks: Sequence[Look]) -> Look:
    """The mean over episodes, where the last of them is."""
    episodes = sum(look.episodes for look in looks)
    successes = sum(look.success_rate * look.episodes for look in looks if look.episodes)
    return Look(hours=looks[-1].hours, steps=looks[-1].steps, success_rate=successes / episodes, episodes=episodes)


def _read(path: Path) -> tuple[Look, ...]:
    rows = csv.DictReader(read_bytes(path, what="learning curve").decode(errors="replace").splitlines())
    try:
        return tuple(_to_look(row) for row in rows)
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidFileError(path, f"not a learning curve ({type(error).__name__}: {error})") from None


def _to_look(row: Mapping[str, str]) -> Look:
    return Look(
        hours=float(row["timing_seconds"]) / 3600,
        steps=int(row["environment_steps"]),
        success_rate=float(row["success_rate"]),
        episodes=int(row["episodes"]),
    )
