"""What an annotation run did, as tables."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from rich.table import Table

from clutter6d.assets.annotation.annotator import Usage
from clutter6d.assets.annotation.run import Outcome

_SHOWN_CHANGES = 20


@dataclass(frozen=True, kw_only=True, slots=True)
class Prices:
    """What an endpoint takes for a million tokens, in any currency; ``None`` if unknown."""

    input_per_million: float | None = None
    output_per_million: float | None = None

    def cost_of(self, usage: Usage) -> float | None:
        """The cost, or ``None`` if a price is unknown."""
        if self.input_per_million is None or self.output_per_million is None:
            return None
        paid = usage.input_tokens * self.input_per_million + usage.output_tokens * self.output_per_million
        return paid / 1e6


def annotation_tables(outcomes: Sequence[Outcome], left: int, prices: Prices) -> tuple[Table, ...]:
    """Changes, what to look at, and the summary; see :func:`summary_table`."""
    changes = (changes_table(outcomes),) if any(outcome.changes for outcome in outcomes) else ()
    notes = (notes_table(outcomes),) if any(outcome.reason or outcome.notes for outcome in outcomes) else ()
    return (*changes, *notes, summary_table(outcomes, left, prices))


def summary_table(outcomes: Sequence[Outcome], left: int, prices: Prices) -> Table:
    """Counts by what became of the assets, and what the answers cost.

    Args:
        outcomes: Of the run.
        left: Assets that had no open values, or were beyond the limit.
        prices: Of the endpoint.
    """
    counts = Counter(outcome.status for outcome in outcomes)
    title = f"{counts['annotated']} of {len(outcomes)} assets annotated"
    table = Table("assets", "", title=title, min_width=len(title) + 2)
    table.add_row("annotated", str(counts["annotated"]))
    table.add_row("unchanged", str(counts["unchanged"]))
    if counts["unasked"]:
        table.add_row("would be asked for", str(counts["unasked"]))
    table.add_row("not looked at", str(left))
    for reason, count in Counter(outcome.reason for outcome in outcomes if outcome.status == "failed").most_common():
        table.add_row(f"failed: {reason}", str(count))
    table.add_row("with a note", str(sum(bool(outcome.notes) for outcome in outcomes)))
    for name, value in _costs(outcomes, prices).items():
        table.add_row(name, value)
    return table


def changes_table(outcomes: Sequence[Outcome]) -> Table:
    """What changed, asset by asset; the first of many."""
    changed = sorted((outcome for outcome in outcomes if outcome.changes), key=lambda outcome: outcome.name)
    left_out = f", the first {_SHOWN_CHANGES} of {len(changed)}" if len(changed) > _SHOWN_CHANGES else ""
    table = Table("asset", "what", "from", "to", title=f"Changes{left_out}")
    for outcome in changed[:_SHOWN_CHANGES]:
        for index, (name, (old, new)) in enumerate(outcome.changes.items()):
            table.add_row(outcome.name if index == 0 else "", name, _shown(old), _shown(new))
    return table


def notes_table(outcomes: Sequence[Outcome]) -> Table:
    """Failures and notes."""
    table = Table("asset", "what happened", title="To look at")
    for outcome in outcomes:
        for line in ((f"{outcome.reason}: {outcome.detail}",) if outcome.reason else ()) + outcome.notes:
            table.add_row(outcome.name, line)
    return table


def _costs(outcomes: Sequence[Outcome], prices: Prices) -> dict[str, str]:
    usage = sum((outcome.usage for outcome in outcomes), Usage())
    remembered = sum(outcome.is_remembered for outcome in outcomes)
    if not usage.answers and not remembered:
        return {}
    cost = prices.cost_of(usage)
    return {
        "answers": f"{usage.answers} asked for, {remembered} remembered",
        "tokens": f"{usage.input_tokens:,} in, {usage.output_tokens:,} out",
        "cost": "unknown: give --price-in and --price-out" if cost is None else f"{cost:.4f}",
    }


def _shown(value: str | float) -> str:
    return value if isinstance(value, str) else f"{value:.3g}"
