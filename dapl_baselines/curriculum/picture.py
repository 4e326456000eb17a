"""Success over the rounds of a curriculum, drawn (paper, Figure "Success rate over curriculum iterations")."""

import io
from collections.abc import Sequence
from typing import Any, Final

from clutter6d.eval.metrics import wilson_interval
from dapl_baselines.curriculum.round_result import RoundResult

_BLUE: Final = "#0072b2"
"""Of the palette by Okabe and Ito, told apart by everyone."""


def draw_curriculum(results: Sequence[RoundResult]) -> bytes:
    """A PNG: the share of validation episodes that succeed, with its 95% Wilson interval, by round."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.2, 3.6), layout="constrained")
    axes: Any = figure.add_subplot()
    rounds = [result.round for result in results]
    rates = [100 * result.validation.success_rate for result in results]
    lows, highs = zip(*(_interval_percent(result) for result in results), strict=True)
    below, above = ([abs(rate - end) for rate, end in zip(rates, ends, strict=True)] for ends in (lows, highs))
    style = {"color": _BLUE, "marker": "o", "linewidth": 2, "capsize": 4, "elinewidth": 1, "clip_on": False}
    axes.errorbar(rounds, rates, yerr=(below, above), **style)
    for number, rate, before in zip(rounds, rates, [0.0, *rates], strict=False):
        # On the side of the point from which no line comes.
        place = (-6, 5) if rate >= before else (-6, -14)
        axes.annotate(f"{rate:.1f}%", (number, rate), place, textcoords="offset points", ha="right", color=_BLUE)
    episodes = results[-1].validation.episodes
    axes.set(xlabel="round", ylabel=f"success on {episodes} validation episodes [%]")
    axes.set(xticks=rounds, xlim=(0.4, rounds[-1] + 0.4), ylim=(0, min(105, 1.1 * max(highs))))
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", alpha=0.3)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=150, metadata={"Software": None})
    return buffer.getvalue()


def _interval_percent(result: RoundResult) -> tuple[float, float]:
    found = result.validation
    low, high = wilson_interval(round(found.success_rate * found.episodes), found.episodes)
    return 100 * low, 100 * high
